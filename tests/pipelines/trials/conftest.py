"""A lane in which small planners of our own drive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.robot import Robot
from graspe_data.simulation.field import Field, build_field
from graspe_data.simulation.scenario import Scenario
from pipelines.trials.config import Conditions
from pipelines.trials.run_trial import Run, run_trial, trial_scenario
from pipelines.trials.settings import TrialSettings
from pipelines.trials.situations import Senses
from pipelines.trials.summary import TrialIdentity, summarise
from pipelines.trials.trial import Trial
from planners.situation import Command, Planner, Situation

NO_SENSES = Senses(camera=False, lidar=False)
LANE: dict[str, Any] = {
    "name": "lane",
    "goal": [3.0, 0.0],
    "world": {
        "length": 12.0,
        "width": 6.0,
        "start": [-3.0, 0.0, 0.5],
        "start_clearance": 0.6,
        "ground": {"cover": "gravel", "amplitude": 0.0, "cell": 2.0},
    },
    "light": {"sky": "overcast"},
    "camera": {"width": 80, "height": 60},
    "lidar": {"rotation_rate": 20.0, "sub_rays": 1},
}
BUSH = {"kind": "bush", "at": [[0.5, 0.0]], "radius": [0.5, 0.5], "give": [0.1, 0.1]}
WALL = {"kind": "wall", "lines": [[[1.0, -2.0], [1.0, 2.0]]]}

LaneOf = Callable[..., Field]
Drives = Callable[..., tuple[Run, Trial]]


@dataclass
class Aims:
    """Turns toward the goal while it drives at a speed; remembers what it was asked with."""

    speed: float = 0.6
    asked: list[Situation] = field(default_factory=list)

    def command(self, situation: Situation) -> Command:
        self.asked.append(situation)
        x, y, yaw = situation.pose
        error = np.arctan2(situation.goal[1] - y, situation.goal[0] - x) - yaw
        turn = (error + np.pi) % (2 * np.pi) - np.pi
        return Command(self.speed, float(np.clip(turn, -0.6, 0.6)))


@dataclass
class Holds:
    """Holds one velocity."""

    v: float
    omega: float = 0.0
    reason: str = ""

    def command(self, situation: Situation) -> Command:
        del situation
        return Command(self.v, self.omega, self.reason)


@pytest.fixture(scope="session")
def aims() -> type[Aims]:
    return Aims


@pytest.fixture(scope="session")
def holds() -> type[Holds]:
    return Holds


@pytest.fixture(scope="session")
def spot() -> Robot:
    return load_manifest(find_manifest("robots", "spot"), Robot)


@pytest.fixture(scope="session")
def lane_of(spot: Robot) -> LaneOf:
    def build(*features: dict[str, Any], seed: int = 0, **settings: Any) -> Field:
        world = LANE["world"] | {"features": list(features)}
        scenario = Scenario.model_validate(LANE | {"world": world})
        prepared = trial_scenario(scenario, TrialSettings(**settings))
        return build_field(prepared, spot, seed, threads=1)

    return build


@pytest.fixture(scope="session")
def bush() -> dict[str, Any]:
    return BUSH


@pytest.fixture(scope="session")
def wall() -> dict[str, Any]:
    return WALL


@pytest.fixture(scope="session")
def drives(lane_of: LaneOf) -> Drives:
    """Drives through a lane with some features, without sensors unless asked for."""

    def drive(
        planner: Planner,
        features: Sequence[dict[str, Any]] = (),
        senses: Senses = NO_SENSES,
        seed: int = 0,
        **changes: Any,
    ) -> tuple[Run, Trial]:
        lane, settings = lane_of(*features, seed=seed, **changes), TrialSettings(**changes)
        run = run_trial(lane, planner, settings, senses)
        conditions = Conditions(scenario=lane.scenario, robot=lane.robot, trial=settings)
        return run, summarise(lane, run, settings, TrialIdentity("ours", conditions.digest))

    return drive
