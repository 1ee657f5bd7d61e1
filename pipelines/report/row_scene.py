"""One row of a dataset with all that is needed to draw it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.manifest import validate
from graspe_data.observation.trajectory_arc import constant_velocity_arc
from graspe_data.observation.trajectory_image import trajectory_image
from graspe_data.robot import Intrinsics
from graspe_data.shards.dataset_manifest import DatasetIndex, RecordingEntry
from pipelines.dataset_settings import DatasetRecipe

Floats = NDArray[np.float64]

SCENE_COLUMNS = (
    "image",
    "points",
    "intensity",
    "laser_scan",
    "velocity_history",
    "trajectory_image",
    "success",
    "success_mask",
    "r_bright",
    "r_corners",
    "r_img",
    "r_edge",
    "r_planar",
    "r_point",
    "stamp_ns",
    "points_age_ns",
    "odometry_age_ns",
    "recording",
)
CONTINUED_TO_M = 15.0
STANDING_M_S = 0.1
DASH_M = 1.0
POSES_A_METRE = 10


@dataclass(frozen=True)
class RowScene:
    """A row, decoded, with its trajectory.

    Attributes:
        row: The columns of ``SCENE_COLUMNS``, decoded, one row.
        recipe: The configuration that the dataset was made with.
        recording: Name of the recording.
        arc: Poses (M, 3) of the predicted trajectory: x, y in metres, yaw in rad, base_link.
        ahead: Poses (K, 3) of the same arc from its end on; empty where it is not continued.
        dashes: bool (H, W), ``ahead`` in the picture in dashes of one metre; all False where the
            trajectory itself is in the picture, or the camera's calibration is not recorded.
        pixel_aspect: Height of what a pixel sees over its width; 1 for square pixels.
    """

    row: Mapping[str, NDArray[Any]]
    recipe: DatasetRecipe
    recording: str
    arc: Floats
    ahead: Floats
    dashes: NDArray[np.bool_]
    pixel_aspect: float

    @property
    def velocity(self) -> tuple[float, float]:
        """Linear velocity and yaw rate at the anchor, m/s and rad/s."""
        v, omega = self.row["velocity_history"][-1].tolist()
        return v, omega

    @property
    def picture_shows_arc(self) -> bool:
        """Whether a part of the predicted trajectory lies in the picture."""
        return bool(self.row["trajectory_image"].any())


def row_scene(index: DatasetIndex, row: Mapping[str, NDArray[Any]]) -> RowScene:
    """Prepare a row for drawing.

    Args:
        index: Of the dataset that the row is from.
        row: Its columns, as ``Dataset(..., columns=SCENE_COLUMNS).row(i)`` gives them.

    Raises:
        ManifestError: The dataset's configuration does not validate, as of another version.
    """
    recipe = validate(dict(index.configuration), DatasetRecipe, f"{index.name}: configuration")
    entry = index.recordings[int(row["recording"])]
    v, omega = row["velocity_history"][-1].tolist()
    horizon = recipe.dataset.horizon
    ahead, dashes = np.empty((0, 3)), np.zeros(row["trajectory_image"].shape, np.bool_)
    camera = _camera(entry)
    if not row["trajectory_image"].any():
        ahead = _continued(v, omega, horizon.steps * horizon.step_s)
        if camera is not None:
            dashes = _dashes(ahead, camera, recipe)
    return RowScene(
        row=row,
        recipe=recipe,
        recording=entry.name,
        arc=constant_velocity_arc(v, omega, horizon.steps, horizon.step_s),
        ahead=ahead,
        dashes=dashes,
        pixel_aspect=camera[0].fx / camera[0].fy if camera else 1.0,
    )


def _camera(entry: RecordingEntry) -> tuple[Intrinsics, Transform] | None:
    """The calibration that ``dataset.json`` keeps of a recording, if it does."""
    camera, mounting = entry.details.get("camera"), entry.details.get("base_from_camera")
    if not isinstance(camera, dict) or not isinstance(mounting, list):
        return None
    where = f"{entry.name}: camera in dataset.json"
    rotation, translation = (np.array(part, np.float64) for part in mounting)
    transform = Transform(rotation.reshape(3, 3), translation.reshape(3))
    return validate(camera, Intrinsics, where), transform


def _continued(v: float, omega: float, horizon_s: float) -> Floats:
    """The arc from the horizon's end to ``CONTINUED_TO_M``, or to a quarter turn if that is less.

    A robot that stands has no arc to continue.
    """
    if abs(v) < STANDING_M_S:
        return np.empty((0, 3))
    quarter_turn_s = np.pi / 2 / max(abs(omega), np.finfo(np.float64).tiny)
    last_s = min(CONTINUED_TO_M / abs(v), quarter_turn_s)
    parts = int(CONTINUED_TO_M * POSES_A_METRE)
    poses = constant_velocity_arc(v, omega, parts, last_s / parts)
    return poses[np.arange(parts + 1) * (last_s / parts) >= horizon_s]


def _dashes(
    ahead: Floats, camera: tuple[Intrinsics, Transform], recipe: DatasetRecipe
) -> NDArray[np.bool_]:
    intrinsics, base_from_camera = camera
    drawn = np.zeros((intrinsics.height, intrinsics.width), np.bool_)
    height, width = recipe.robot.base_height, recipe.robot.footprint.width
    length = int(DASH_M * POSES_A_METRE)
    for start in range(0, len(ahead) - 1, 2 * length):
        dash = ahead[start : start + length + 1]
        drawn |= trajectory_image(dash, intrinsics, base_from_camera, height, width)
    return drawn
