"""The real recordings, where they are at hand, and a small garden to record drives in."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

import pytest

from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.robot import Robot
from graspe_data.simulation.motion.drivers import Leg, ScriptedDriver
from graspe_data.simulation.scenario import Scenario
from graspe_data.simulation.simulated_drive import SimulatedDrive, simulate_drive

GARDEN: dict[str, Any] = {
    "name": "garden",
    "world": {
        "length": 20.0,
        "width": 12.0,
        "start_clearance": 0.6,
        "ground": {"cover": "gravel", "amplitude": 0.0, "cell": 2.0},
        "features": [
            {"kind": "bush", "at": [[2.9, 0.4]], "radius": [0.5, 0.5], "give": [0.1, 0.1]},
            {"kind": "pillar", "at": [[4.0, 1.6], [-3.0, -2.0]]},
            {"kind": "wall", "lines": [[[8.0, -3.0], [8.0, 3.0]]]},
        ],
    },
    "light": {"sky": "overcast"},
    "camera": {"width": 160, "height": 120, "rate": 5.0},
    "lidar": {"rate": 5.0, "rotation_rate": 20.0, "sub_rays": 1},
}


@pytest.fixture(autouse=True, scope="session")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What blind references said is kept in a folder of the tests, not in the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("GRASPE_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


class GardenDrive(Protocol):
    """Drives legs through the garden."""

    def __call__(
        self, legs: Sequence[Leg], seed: int = 0, **changes: dict[str, Any]
    ) -> SimulatedDrive:
        """Drive as long as the legs last; changes are to groups of the scenario's settings."""
        ...


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of the real recordings."""
    folder = os.environ.get("GRASPE_RECORDINGS")
    if not folder:
        pytest.skip("GRASPE_RECORDINGS is not set: the real recordings are not at hand")
    return Path(folder)


@pytest.fixture(scope="session")
def garden_drive() -> GardenDrive:
    """Drives from x = 0 towards a bush that begins at x = 2.4 m and entangles.

    The front of the robot is 0.55 m ahead of where it is.
    """
    robot = load_manifest(find_manifest("robots", "spot"), Robot)

    def drive(legs: Sequence[Leg], seed: int = 0, **changes: dict[str, Any]) -> SimulatedDrive:
        seconds = sum(leg.duration_s for leg in legs)
        groups = {name: GARDEN.get(name, {}) | change for name, change in changes.items()}
        scenario = Scenario.model_validate(GARDEN | groups)
        scenario = scenario.model_copy(update={"duration_s": seconds})
        return simulate_drive(scenario, robot, seed, threads=1, driver=ScriptedDriver(legs))

    return drive
