"""PointCloud2 and LaserScan messages as arrays, whatever the layout of their fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.byte_order import in_true_order
from graspe_data.recordings.decoding.header import place, refuses_unfit_messages, stamp_ns
from graspe_data.recordings.decoding.organised_rings import organised_rings
from graspe_data.sensor_data import PlanarScan, PointCloud

INTENSITY_NAMES: Final = ("intensity", "intensities", "i", "reflectivity")
RING_NAMES: Final = ("ring", "channel", "laser_id", "line")

# sensor_msgs/PointField: INT8 = 1 ... FLOAT64 = 8.
_TYPES: Final = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}

Floats32 = NDArray[np.float32]


@refuses_unfit_messages
def decode_points(message: Any, topic: str, strength: str | None = None) -> PointCloud:
    """Decode a sensor_msgs/PointCloud2.

    Any order, offset, type and padding of fields, of points and of rows, and both byte orders; a
    byte order that is declared wrongly is mended, see `in_true_order`. Intensity is the field
    ``strength``, without one the first present of ``intensity``, ``intensities``, ``i`` and
    ``reflectivity``; ring the first of
    ``ring``, ``channel``, ``laser_id`` and ``line`` that is of an integer type, else the row or the
    column of an organised cloud, if that is a ring, see `organised_rings`, else None. Points whose
    x, y or z is NaN or infinite as float32, or which lie at (0, 0, 0), are removed. Of an empty
    cloud the fields are not looked at: intensity and ring are None.

    Raises:
        RecordingError: x, y or z is absent or no float, ``strength`` is absent, a field lies
            outside its point, there is less data than the size asks for, or most points lie where
            no lidar reaches.
    """
    where = place(topic, message.header)
    points = in_true_order(_structured(message, where, strength), where)
    names = points.dtype.names or ()
    with np.errstate(over="ignore", invalid="ignore"):
        axes = np.array([points[axis].reshape(-1) for axis in "xyz"], np.float32)
        kept = _returned(axes)
        intensity = _column(points, "intensity", np.float32) if "intensity" in names else None
    if "ring" in names:
        ring: NDArray[np.int32] | None = _column(points, "ring", np.int32)
    else:
        x, y, z = axes.reshape(3, *points.shape)
        ring = organised_rings(x, y, z)
    return PointCloud(
        stamp_ns=stamp_ns(message.header),
        frame=message.header.frame_id,
        xyz=(axes if kept is None else axes.take(kept, axis=1)).T,
        intensity=None if intensity is None else _take(intensity, kept),
        ring=None if ring is None else _take(ring, kept),
    )


def _structured(message: Any, where: str, strength: str | None) -> NDArray[np.void]:
    """A view on the message's bytes, (H, W), with the fields x, y, z, intensity, ring."""
    height, width, step = int(message.height), int(message.width), int(message.point_step)
    if not (height and width):
        return np.empty((0, 0), [("x", "f4"), ("y", "f4"), ("z", "f4")])
    row_step = int(message.row_step) if height > 1 else width * step
    needed = row_step * (height - 1) + width * step
    if row_step < width * step or len(message.data) < needed:
        raise RecordingError(
            f"{where}: {height} rows of {width} points, {step} bytes a point and {row_step} a row, "
            f"need {needed} bytes of data; found {len(message.data)}. The message is damaged or "
            f"its driver is wrong."
        )
    fields = {field.name: field for field in reversed(message.fields)}
    if strength is not None and strength not in fields:
        raise RecordingError(
            f"{where}: no field {strength!r}; found {', '.join(sorted(fields))}. Correct "
            f"`lidar.intensity_field` in the robot manifest."
        )
    names = INTENSITY_NAMES if strength is None else (strength,)
    dtype = _point_type(fields, names, step, bool(message.is_bigendian), where)
    return np.ndarray((height, width), dtype, buffer=message.data, strides=(row_step, step))


def _point_type(
    fields: Mapping[str, Any], strengths: Sequence[str], step: int, big_endian: bool, where: str
) -> np.dtype[np.void]:
    chosen = {axis: fields[axis] for axis in "xyz" if axis in fields}
    if len(chosen) < len("xyz") or any(field.datatype not in (7, 8) for field in chosen.values()):
        present = reversed(list(fields.values()))
        described = ", ".join(f"{f.name} {_TYPES.get(f.datatype, '?')}" for f in present)
        raise RecordingError(
            f"{where}: a cloud needs x, y and z of float32 or float64; found the fields "
            f"{described or 'none'}. Name another topic as `points` in the robot manifest."
        )
    intensity = _first(fields, strengths, "iuf")
    ring = _first(fields, RING_NAMES, "iu")
    chosen |= {"intensity": intensity} if intensity else {}
    chosen |= {"ring": ring} if ring else {}
    order = ">" if big_endian else "<"
    formats = [np.dtype(order + _TYPES[field.datatype]) for field in chosen.values()]
    offsets = [int(field.offset) for field in chosen.values()]
    for name, form, offset in zip(chosen, formats, offsets, strict=True):
        if offset + form.itemsize > step:
            raise RecordingError(
                f"{where}: field {name} takes bytes {offset} to {offset + form.itemsize} of a "
                f"point of {step} bytes. The message is damaged or its driver is wrong."
            )
    names = list(chosen)
    layout = {"names": names, "formats": formats, "offsets": offsets, "itemsize": step}
    return cast("np.dtype[np.void]", np.dtype(cast("Any", layout)))


def _first(fields: Mapping[str, Any], names: Sequence[str], kinds: str) -> Any | None:
    present = (fields[name] for name in names if name in fields)
    return next((f for f in present if _TYPES.get(f.datatype, "?")[0] in kinds), None)


def _returned(axes: Floats32) -> NDArray[np.intp] | None:
    """Indices of the points that are finite and off the origin; None where all are.

    |x| + |y| + |z| is NaN or infinite where a coordinate is, and zero only at the origin.
    """
    distance = np.abs(axes[0]) + np.abs(axes[1]) + np.abs(axes[2])
    kept = (distance > 0) & (distance < np.inf)
    return None if kept.all() else np.flatnonzero(kept)


def _take(values: NDArray[Any], kept: NDArray[np.intp] | None) -> NDArray[Any]:
    return values if kept is None else values.take(kept)


def _column(points: NDArray[np.void], name: str, dtype: type[np.generic]) -> NDArray[Any]:
    return points[name].astype(dtype).reshape(-1)


@refuses_unfit_messages
def decode_scan(message: Any, topic: str) -> PlanarScan:
    """Decode a sensor_msgs/LaserScan; ranges stay as published, NaN and infinite ones included.

    Raises:
        RecordingError: The angles are not finite, or several rays have one angle.
    """
    start, increment = float(message.angle_min), float(message.angle_increment)
    if not (isfinite(start) and isfinite(increment)) or (
        increment == 0.0 and len(message.ranges) > 1
    ):
        raise RecordingError(
            f"{place(topic, message.header)}: {len(message.ranges)} rays from angle {start} rad in "
            f"steps of {increment} rad; expected finite angles and a step. The driver is wrong."
        )
    return PlanarScan(
        stamp_ns=stamp_ns(message.header),
        frame=message.header.frame_id,
        angle_minimum=start,
        angle_increment=increment,
        ranges=np.array(message.ranges, np.float32),
    )
