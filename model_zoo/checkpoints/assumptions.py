"""What a dataset's configuration says of its observations and its robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self, TypeVar

from pydantic import ConfigDict, model_validator

from graspe_data.bundle_contract import Assumptions, RobotContract, SensorPose
from graspe_data.calibration import (
    RecordedCalibration,
    Sensor,
    StoredTransform,
    declared_mounting,
    restored,
)
from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import validate
from graspe_data.observation.settings import HistorySettings, ObservationManifest
from graspe_data.robot import Robot
from graspe_data.shards.dataset_index import DatasetIndex

Value = TypeVar("Value")


def read_assumptions(index: DatasetIndex) -> Assumptions | None:
    """Read what a planner must repeat to derive the inputs of a model trained on a dataset.

    Returns:
        None where the dataset does not tell, as one that no pipeline made.

    Raises:
        ZooError: The configuration is there and does not validate.
    """
    configuration = index.configuration
    if not {"dataset", "robot"} <= configuration.keys():
        return None
    where = f"configuration of the dataset {index.name}"
    try:
        observed = validate(_mapping(configuration["dataset"]), _RecordedObservation, where)
        robot = validate(_mapping(configuration["robot"]), Robot, where)
        return Assumptions(observation=observed.on_robot(robot), robot=_robot(index, robot))
    except (ManifestError, ValueError, TypeError) as error:
        raise ZooError(f"{error}\nBuild the dataset again.") from error


class _RecordedHistory(HistorySettings):
    """The window of a dataset says more than its history."""

    model_config = ConfigDict(extra="ignore")


class _RecordedObservation(ObservationManifest):
    """The manifest of a dataset says more than how it observes."""

    model_config = ConfigDict(extra="ignore")

    window: _RecordedHistory

    @model_validator(mode="after")
    def _complete(self) -> Self:
        needed = ObservationManifest.model_fields.keys() - {"trajectory_image"}
        if missing := sorted(needed - self.model_fields_set):
            raise ValueError(f"{', '.join(missing)}: missing")
        return self


def _robot(index: DatasetIndex, robot: Robot) -> RobotContract:
    """The robot; a calibration that its manifest does not give is taken from the recordings."""
    recorded = [entry.calibration for entry in index.recordings if entry.rows]
    unknown: dict[str, str] = {}
    camera = _common([each.camera for each in recorded], "camera", unknown)
    return RobotContract(
        name=robot.name,
        camera=camera,
        base_from_camera=_mounting(robot, "camera", recorded, unknown),
        base_from_lidar=_mounting(robot, "lidar", recorded, unknown),
        camera_frame=robot.camera.frame,
        lidar_frame=robot.lidar.frame,
        base_height=robot.base_height,
        footprint=robot.footprint,
        limits=robot.limits,
        unknown=unknown,
    )


def _mounting(
    robot: Robot,
    sensor: Sensor,
    recorded: Sequence[RecordedCalibration],
    unknown: dict[str, str],
) -> SensorPose | None:
    mounting = declared_mounting(robot, sensor)
    if mounting is not None:
        return SensorPose.of(mounting)
    name = f"base_from_{sensor}"
    kept: StoredTransform | None = _common(
        [getattr(each, name) for each in recorded], name, unknown
    )
    return None if kept is None else SensorPose.of(restored(kept))


def _common(values: Sequence[Value | None], name: str, unknown: dict[str, str]) -> Value | None:
    """What all recordings that tell it tell alike; else None, and why."""
    known = [value for value in values if value is not None]
    if known and all(value == known[0] for value in known):
        return known[0]
    unknown[name] = "its recordings differ" if known else "the dataset does not tell"
    return None


def _mapping(value: Any) -> dict[str, Any]:
    return dict(value) if isinstance(value, Mapping) else {}
