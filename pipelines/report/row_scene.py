"""One row of a dataset with all that is needed to draw it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform
from graspe_data.manifest import validate
from graspe_data.observation.catalogue import RELIABILITIES
from graspe_data.observation.trajectory import constant_velocity_arc, trajectory_image
from graspe_data.robot import Intrinsics
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry
from pipelines.dataset_settings import DatasetRecipe

SCENE_COLUMNS = (
    "image",
    "points",
    "intensity",
    "laser_scan",
    "velocity_history",
    "trajectory_image",
    "success",
    "success_mask",
    *RELIABILITIES,
    "stamp_ns",
    "points_age_ns",
    "odometry_age_ns",
    "recording",
)
CONTINUED_TO_M = 15.0
STANDING_M_S = 0.1
OWN_BODY_M = 0.3
POSES_A_METRE = 10
ARC_PARTS = 30


@dataclass(frozen=True)
class RowScene:
    """A row, decoded, with its trajectory.

    Attributes:
        row: The columns of ``SCENE_COLUMNS``, decoded, one row.
        recipe: The configuration that the dataset was made with.
        recording: Name of the recording.
        time_s: Seconds from the recording's time zero, from which label intervals count; None
            where the dataset does not keep it.
        arc: Poses (M, 3) of the predicted trajectory: x, y in metres, yaw in rad, base_link.
        ahead: Poses (K, 3) of the same arc from its end on; empty where it is not continued.
        ribbon: bool (H, W), ``arc`` in the picture.
        ribbon_ahead: bool (H, W), ``ahead`` in the picture, up to the first obstacle that the
            laser scan sees on it; all False where ``ahead`` is empty, or the camera's calibration
            is not recorded.
        ribbon_beyond: bool (H, W), the same from that obstacle on.
        pixel_aspect: Height of what a pixel sees over its width; 1 for square pixels.
        camera: Intrinsics of the stored picture and base_from_camera; None where not recorded.
    """

    row: Mapping[str, NDArray[Any]]
    recipe: DatasetRecipe
    recording: str
    time_s: float | None
    arc: Floats
    ahead: Floats
    ribbon: NDArray[np.bool_]
    ribbon_ahead: NDArray[np.bool_]
    ribbon_beyond: NDArray[np.bool_]
    pixel_aspect: float
    camera: tuple[Intrinsics, Transform] | None

    @property
    def velocity(self) -> tuple[float, float]:
        """Linear velocity and yaw rate at the anchor, m/s and rad/s."""
        v, omega = self.row["velocity_history"][-1].tolist()
        return v, omega

    @property
    def continued_to(self) -> float:
        """Length of the trajectory with its continuation, metres, 0 without."""
        if not len(self.ahead):
            return 0.0
        points_ahead = np.concatenate((self.arc, self.ahead))[:, :2]
        return float(np.linalg.norm(np.diff(points_ahead, axis=0), axis=1).sum())

    @property
    def picture_shows_arc(self) -> bool:
        """Whether a part of the predicted trajectory lies in the picture."""
        return bool(self.ribbon.any())


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
    camera = _camera(entry)
    ahead = np.empty((0, 3))
    nothing = np.zeros(row["trajectory_image"].shape, np.bool_)
    ribbon = row["trajectory_image"].astype(np.bool_)
    if recipe.dataset.trajectory_image.behind:
        part_s = horizon.steps * horizon.step_s / ARC_PARTS
        poses = constant_velocity_arc(v, omega, ARC_PARTS, part_s)
        ribbon = _ribbon(poses, camera, recipe) if camera else nothing
    if not ribbon.any():
        ahead = _continued(v, omega, horizon.steps * horizon.step_s)
    free = _free_poses(ahead, scan_points(row["laser_scan"], recipe), recipe)
    return RowScene(
        row=row,
        recipe=recipe,
        recording=entry.name,
        time_s=_time_s(entry, int(row["stamp_ns"])),
        arc=constant_velocity_arc(v, omega, horizon.steps, horizon.step_s),
        ahead=ahead,
        ribbon=ribbon,
        ribbon_ahead=_ribbon(ahead[: free + 1], camera, recipe) if camera else nothing,
        ribbon_beyond=_ribbon(ahead[free:], camera, recipe) if camera else nothing,
        pixel_aspect=camera[0].fx / camera[0].fy if camera else 1.0,
        camera=camera,
    )


def scan_points(scan: NDArray[np.float32], recipe: DatasetRecipe) -> Floats:
    """The points (K, 2) of a laser scan in base_link, metres; empty rays give none."""
    half = recipe.dataset.points.laser_scan.half_angle
    angle = -half + (np.arange(scan.size) + 0.5) * (2 * half / scan.size)
    points = scan[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    return np.asarray(points[np.isfinite(scan)], np.float64)


def _time_s(entry: RecordingEntry, stamp_ns: int) -> float | None:
    zero = entry.details.get("time_zero_ns")
    return (stamp_ns - zero) / 1e9 if isinstance(zero, int) else None


def _camera(entry: RecordingEntry) -> tuple[Intrinsics, Transform] | None:
    """The calibration that ``dataset.json`` keeps of a recording, if it does."""
    kept = entry.calibration
    mounting = kept.mounting("camera")
    return None if kept.camera is None or mounting is None else (kept.camera, mounting)


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


def _free_poses(ahead: Floats, obstacles: Floats, recipe: DatasetRecipe) -> int:
    """How many poses of the continued arc come before the first obstacle on it.

    An obstacle counts at the pose that it is nearest to; returns from the robot itself do not.
    """
    if not len(ahead) or not len(obstacles):
        return len(ahead)
    apart = np.linalg.norm(obstacles[:, None] - ahead[None, :, :2], axis=-1)
    nearest = apart.argmin(axis=1)
    size = recipe.robot.footprint
    own = (np.abs(obstacles) < (size.length / 2 + OWN_BODY_M, size.width / 2 + OWN_BODY_M)).all(1)
    on_it = (apart.min(axis=1) < size.width / 2) & (nearest > 0) & ~own
    return int(nearest[on_it].min(initial=len(ahead)))


def _ribbon(
    poses: Floats, camera: tuple[Intrinsics, Transform], recipe: DatasetRecipe
) -> NDArray[np.bool_]:
    intrinsics, base_from_camera = camera
    height, width = recipe.robot.base_height, recipe.robot.footprint.width
    return trajectory_image(poses, intrinsics, base_from_camera, height, width)
