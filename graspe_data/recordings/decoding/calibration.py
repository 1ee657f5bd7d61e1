"""CameraInfo messages as calibrations of the pictures that they accompany."""

from __future__ import annotations

from typing import Any, Final, Literal, NamedTuple

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.header import place, refuses_unfit_messages, stamp_ns
from graspe_data.recordings.decoding.picture_encodings import check_size
from graspe_data.robot import Intrinsics
from graspe_data.sensor_data import CameraCalibration


class _Model(NamedTuple):
    """A distortion model by OpenCV's name, and the counts of coefficients that it takes."""

    name: Literal["plumb_bob", "rational_polynomial", "equidistant"]
    counts: tuple[int, ...]


_MODELS: Final = {
    "plumb_bob": _Model("plumb_bob", (4, 5)),
    "rational_polynomial": _Model("rational_polynomial", (8, 12, 14)),
    "equidistant": _Model("equidistant", (4,)),
    "fisheye": _Model("equidistant", (4,)),
}


@refuses_unfit_messages
def decode_calibration(message: Any, topic: str, *, rectified: bool = False) -> CameraCalibration:
    """Decode a sensor_msgs/CameraInfo; ``K``/``k`` and ``D``/``d`` as ROS 1 and ROS 2 spell them.

    Binning and region of interest are applied, so that the intrinsics are those of the pictures on
    the topic: cx' = (cx - roi.x_offset) / binning_x, as image_geometry does.

    Args:
        message: The message, with ROS's attributes.
        topic: Named in errors.
        rectified: The pictures are rectified: take P and no distortion in place of K and D.

    Raises:
        RecordingError: The camera is not calibrated, has no size, or its distortion model is none
            of plumb_bob, rational_polynomial, equidistant and fisheye.
    """
    where = place(topic, message.header)
    fx, fy, cx, cy = _focal_and_centre(message, rectified, where)
    model, distortion = ("none", ()) if rectified else _distortion(message, where)
    roi = message.roi
    across, down = max(int(message.binning_x), 1), max(int(message.binning_y), 1)
    width = (int(roi.width) or int(message.width)) // across
    height = (int(roi.height) or int(message.height)) // down
    check_size(width, height, where)
    intrinsics = Intrinsics(
        width=width,
        height=height,
        fx=fx / across,
        fy=fy / down,
        cx=(cx - int(roi.x_offset)) / across,
        cy=(cy - int(roi.y_offset)) / down,
        distortion_model=model,
        distortion=distortion,
    )
    return CameraCalibration(stamp_ns(message.header), message.header.frame_id, intrinsics)


def _focal_and_centre(message: Any, rectified: bool, where: str) -> tuple[float, ...]:
    matrix = _array(message, "P" if rectified else "K").reshape(3, -1)
    values = (matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2])
    if not np.isfinite(values).all() or min(values[:2]) <= 0:
        raise RecordingError(
            f"{where}: the camera is not calibrated: its {'P' if rectified else 'K'} has the focal "
            f"lengths {values[0]} and {values[1]}. Give `camera.intrinsics` in the robot manifest."
        )
    return tuple(float(value) for value in values)


def _distortion(
    message: Any, where: str
) -> tuple[Literal["none", "plumb_bob", "rational_polynomial", "equidistant"], tuple[float, ...]]:
    coefficients = _array(message, "D")
    model = _MODELS.get(message.distortion_model)
    fisheye = model is not None and model.name == "equidistant"
    if not coefficients.any() and not fisheye:
        return "none", ()
    if model is None:
        raise RecordingError(
            f"{where}: distortion model {message.distortion_model!r} is not known; expected one of "
            f"{', '.join(_MODELS)}. Give `camera.intrinsics` in the robot manifest."
        )
    if fisheye and not coefficients.any():
        return "equidistant", (0.0,) * 4
    fitting = [n for n in model.counts if n <= coefficients.size and not coefficients[n:].any()]
    if not fitting or not np.isfinite(coefficients).all():
        raise RecordingError(
            f"{where}: distortion model {message.distortion_model!r} takes "
            f"{' or '.join(map(str, model.counts))} finite coefficients; found "
            f"{coefficients.tolist()}. Give `camera.intrinsics` in the robot manifest."
        )
    return model.name, tuple(coefficients[: fitting[-1]].tolist())


def _array(message: Any, name: str) -> Floats:
    values = getattr(message, name) if hasattr(message, name) else getattr(message, name.lower())
    return np.asarray(values, np.float64)
