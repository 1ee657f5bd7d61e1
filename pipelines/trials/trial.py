"""What came of one trial, as it is written to a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, ValidationError, model_validator

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import StageError
from graspe_data.manifest import Settings
from pipelines.trials.map_score import MapScore

Outcome = Literal["success", "collision", "stuck", "stalled", "left_arena", "timeout"]
FailureKind = Literal["perception", "threshold", "planner", "world"]
Metres = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=0, le=10**9)]
Pose = tuple[float, float, float]

MAXIMUM_BYTES = 16 << 20


class Failure(Settings):
    """Why a trial failed.

    Attributes:
        kind: ``perception``: the model accepted an arc that fails in the world; ``threshold``: it
            rejected all arcs, and some get through; ``world``: none gets through; ``planner``: all
            else, and whatever happens without a model.
        told: The last command before the failure: m/s and rad/s.
        predicted: The least success that the model promised of that arc; None without a model.
        free: Whether that arc gets through the world for the whole horizon.
        obstacle: The material that the robot ran into; empty where it ran into nothing.
    """

    kind: FailureKind
    told: tuple[float, float]
    predicted: float | None
    free: bool
    obstacle: str = ""


class ControlTimes(Settings):
    """Seconds of wall clock that the planner took to answer, over all its answers."""

    answers: Count
    mean_s: Metres
    median_s: Metres
    p90_s: Metres


class Trial(Settings):
    """One trial: who drove where, how it ended, and the way there.

    Attributes:
        conditions: Digest of scenario, robot and settings, which methods share.
        driver: Digest of the method: its settings and, of a bundle, its seal.
        inputs: Digest of the conditions, the seed and the method.
        failure: None for a success.
        duration_s: Simulated time until the end.
        path_m: Length of the way driven.
        straight_m: From the start to the nearest point within the goal's radius.
        collisions: Runs into something solid; of all kinds also those that ended no trial.
        arcs: Commands that asked the robot to move on.
        arcs_free: Of those, how many arcs got through the world for the whole horizon.
        safe_commands: How often the planner had no plan, by its reason.
        start: x, y in metres and yaw in rad, world frame.
        goal: x, y in metres, world frame.
        path: True poses, world frame, ``path_step_s`` apart and at the end.
        maps: Of a planner that drives by a map; None of others.
    """

    format: Literal["graspe-trial-2"] = "graspe-trial-2"
    scenario: str
    method: str
    seed: Count
    conditions: str
    driver: str
    inputs: str
    outcome: Outcome
    failure: Failure | None
    duration_s: Metres
    path_m: Metres
    straight_m: Annotated[float, Field(gt=0)]
    collisions: Count
    stuck: Count
    stumbles: Count
    arcs: Count
    arcs_free: Count
    control: ControlTimes
    safe_commands: dict[str, int]
    start: Pose
    goal: tuple[float, float]
    path_step_s: float
    path: Annotated[tuple[Pose, ...], Field(min_length=1)]
    maps: MapScore | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.success and self.failure is not None:
            raise ValueError("a success has no failure")
        if self.arcs_free > self.arcs:
            raise ValueError(f"arcs_free is {self.arcs_free}, of {self.arcs} arcs")
        return self

    @property
    def success(self) -> bool:
        """Whether the robot arrived."""
        return self.outcome == "success"

    @property
    def normalised_length(self) -> float:
        """Length of the way driven over that of the straight way."""
        return self.path_m / self.straight_m

    def write(self, path: Path) -> None:
        """Write the trial as JSON; the folder has to be there."""
        write_atomically(path, [self.model_dump_json().encode()], StageError)


def read_trial(path: Path) -> Trial:
    """Read a trial.

    Raises:
        StageError: The file cannot be read, or holds no trial.
    """
    try:
        if path.stat().st_size > MAXIMUM_BYTES:
            raise StageError(f"{path}: larger than {MAXIMUM_BYTES} bytes, so no trial.")
        return Trial.model_validate_json(path.read_bytes())
    except OSError as error:
        raise StageError(f"{path}: cannot be read: {error.strerror or error}.") from error
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(str(part) for part in fault["loc"]) or "the whole"
        raise StageError(
            f"{path}: no trial of `graspe navigate run`: {where}: {fault['msg']}. Remove it and "
            f"run the trial again."
        ) from error
