"""What a dataset's configuration says of its observations and its robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict

from graspe_data.bundle_contract import (
    Assumptions,
    Count,
    ObservationContract,
    RobotContract,
    Seconds,
)
from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import validate
from graspe_data.observation.image_reliability import ImageReliabilitySettings
from graspe_data.observation.laser_scan import LaserScanSettings
from graspe_data.observation.observe_points import PointObservationSettings
from graspe_data.observation.point_reliability import PointReliabilitySettings
from graspe_data.observation.point_sample import PointSampleSettings
from graspe_data.robot import Mounting, Robot
from graspe_data.shards.dataset_manifest import DatasetIndex


def read_assumptions(index: DatasetIndex) -> Assumptions | None:
    """Read what a planner must repeat to derive the inputs of a model trained on a dataset.

    Returns:
        None where the dataset does not tell, as one that no pipeline made.

    Raises:
        ZooError: The configuration is there and does not validate.
    """
    told = index.configuration
    if not {"dataset", "robot"} <= told.keys():
        return None
    where = f"configuration of the dataset {index.name}"
    try:
        knobs = validate(_mapping(told["dataset"]), _Knobs, where)
        robot = validate(_mapping(told["robot"]), Robot, where)
        return Assumptions(observation=_observation(knobs, robot), robot=_robot(index, robot))
    except (ManifestError, ValueError, TypeError) as error:
        raise ZooError(f"{error}\nBuild the dataset again.") from error


class _Part(BaseModel):
    """The keys of a dataset's manifest that matter here; it has others."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class _Window(_Part):
    history_steps: Count
    history_step_s: Seconds
    points_tolerance_s: float
    odometry_gap_s: Seconds


class _Horizon(_Part):
    steps: Count
    step_s: Seconds


class _TrajectoryImage(_Part):
    behind: float = 0.0


class _Image(_Part):
    width: Count
    height: Count


class _Points(_Part):
    neighbours: Count
    sample: PointSampleSettings
    laser_scan: LaserScanSettings


class _Knobs(_Part):
    window: _Window
    horizon: _Horizon
    trajectory_image: _TrajectoryImage = _TrajectoryImage()
    image: _Image
    points: _Points
    image_reliability: ImageReliabilitySettings
    point_reliability: PointReliabilitySettings


def _observation(knobs: _Knobs, robot: Robot) -> ObservationContract:
    window, lidar = knobs.window, robot.lidar
    return ObservationContract(
        picture_size=(knobs.image.height, knobs.image.width),
        points=PointObservationSettings(
            **dict(knobs.points),
            rings=lidar.rings,
            intensity_maximum=lidar.intensity_maximum,
            minimum_range=lidar.minimum_range,
            base_height=robot.base_height,
        ),
        image_reliability=knobs.image_reliability,
        point_reliability=knobs.point_reliability,
        **dict(window),
        horizon_steps=knobs.horizon.steps,
        horizon_step_s=knobs.horizon.step_s,
        drawn_from_behind=knobs.trajectory_image.behind,
    )


def _robot(index: DatasetIndex, robot: Robot) -> RobotContract:
    """The robot; a calibration that its manifest does not give is taken from the recordings."""
    details = [entry.details for entry in index.recordings if entry.rows]
    found: dict[str, Any] = {
        name: [told[name] for told in details if told.get(name) is not None]
        for name in ("camera", "base_from_camera", "base_from_lidar")
    }
    for name, sensor in (("base_from_camera", robot.camera), ("base_from_lidar", robot.lidar)):
        if isinstance(sensor.mounting, Mounting):
            transform = sensor.mounting.transform
            found[name] = [[transform.rotation.ravel().tolist(), transform.translation.tolist()]]
    known: dict[str, Any] = {}
    unknown: dict[str, str] = {}
    for name, values in found.items():
        if not values:
            unknown[name] = "the dataset does not tell"
        elif any(value != values[0] for value in values):
            unknown[name] = "its recordings differ"
        else:
            known[name] = values[0] if name == "camera" else _pose(*values[0])
    return RobotContract(
        name=robot.name,
        camera_frame=robot.camera.frame,
        lidar_frame=robot.lidar.frame,
        base_height=robot.base_height,
        footprint=robot.footprint,
        limits=robot.limits,
        unknown=unknown,
        **known,
    )


def _pose(rotation: Sequence[float], translation: Sequence[float]) -> dict[str, Any]:
    rows = [tuple(rotation[begin : begin + 3]) for begin in (0, 3, 6)]
    return {"rotation": tuple(rows), "translation": tuple(translation)}


def _mapping(value: Any) -> dict[str, Any]:
    return dict(value) if isinstance(value, Mapping) else {}
