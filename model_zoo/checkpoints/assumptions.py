"""What a dataset's configuration says of its observations and its robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

from pydantic import ConfigDict, model_validator

from graspe_data.bundle_contract import Assumptions, RobotContract
from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import validate
from graspe_data.observation.settings import HistorySettings, ObservationManifest
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
        observed = validate(_mapping(told["dataset"]), _ToldObservation, where)
        robot = validate(_mapping(told["robot"]), Robot, where)
        return Assumptions(observation=observed.on_robot(robot), robot=_robot(index, robot))
    except (ManifestError, ValueError, TypeError) as error:
        raise ZooError(f"{error}\nBuild the dataset again.") from error


class _ToldHistory(HistorySettings):
    """The window of a dataset says more than its history."""

    model_config = ConfigDict(extra="ignore")


class _ToldObservation(ObservationManifest):
    """The manifest of a dataset says more than how it observes."""

    model_config = ConfigDict(extra="ignore")

    window: _ToldHistory

    @model_validator(mode="after")
    def _complete(self) -> Self:
        needed = ObservationManifest.model_fields.keys() - {"trajectory_image"}
        if missing := sorted(needed - self.model_fields_set):
            raise ValueError(f"{', '.join(missing)}: missing")
        return self


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
