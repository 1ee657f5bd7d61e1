"""When a robot that keeps its command fails: held against the robot that is simulated."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from graspe_data.arrays import Floats
from graspe_data.robot import Robot
from graspe_data.simulation.motion.commanded_arcs import commanded_failure_times
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from graspe_data.simulation.motion.footprint import clearance
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.world.obstacles import Obstacle
from graspe_data.simulation.world.world import World

WorldOf = Callable[..., World]

HORIZON_S = 3.0
AT_ONCE = {"linear_acceleration": 1e3, "yaw_acceleration": 1e3}


def disc(x: float, y: float, radius: float, effect: str, strength: float = 0.0) -> Obstacle:
    material = {"stops": "bark", "entangles": "bush", "slows": "grass"}[effect]
    return Obstacle((x, y), (x, y), radius, effect, material, strength)  # type: ignore[arg-type]


def fails(world: World, robot: Robot, v: float, omega: float = 0.0) -> float:
    asked = world.obstacles, robot.footprint, np.zeros((1, 3)), np.array([[v, omega]])
    return float(commanded_failure_times(*asked, HORIZON_S, MechanicsSettings())[0])


def first(mask: Floats) -> float:
    """Seconds until a step is true."""
    return float(np.argmax(mask) * STEP_S) if mask.any() else np.inf


def driven(
    world: World, robot: Robot, exact: MotionSettings, command: tuple[float, float]
) -> tuple[float, float]:
    """When the simulated robot is caught; and when it is so nearly."""
    quick = robot.model_copy(update={"limits": robot.limits.model_copy(update=AT_ONCE)})
    drive = DriveInProgress(world, quick, exact, HORIZON_S + 0.5, np.random.default_rng(0))
    drive.advance(command, round((HORIZON_S + 0.5) / STEP_S))
    done = drive.drive()
    asked = np.hypot(*command)
    share = np.hypot(*done.velocity.T) / asked
    contacts = done.contacts
    started = np.arange(len(share)) > 0
    caught, nearly = (
        started & (contacts.stopped | (contacts.entangled & (share < limit)))
        for limit in (0.19, 0.22)
    )
    return first(caught), first(nearly)


around = st.floats(-2.5, 2.5)
plants = st.builds(
    disc,
    around,
    around,
    st.floats(0.2, 0.8),
    st.sampled_from(["entangles", "entangles", "slows"]),
    st.floats(0.1, 0.4),
)
trunks = st.builds(disc, around, around, st.floats(0.05, 0.3), st.just("stops"))


@settings(max_examples=60, deadline=None)
@given(
    things=st.lists(plants | trunks, min_size=1, max_size=5),
    v=st.floats(0.1, 0.6),
    omega=st.floats(-0.6, 0.6),
)
def test_it_is_when_the_simulated_robot_is_caught(
    things: list[Obstacle],
    v: float,
    omega: float,
    world_of: WorldOf,
    spot: Robot,
    exact: MotionSettings,
) -> None:
    world = world_of(*things)
    solid = world.obstacles.having("stops")
    assume(clearance(spot.footprint, np.zeros((1, 3)), solid).min(initial=1.0) > 0.02)
    caught, nearly = driven(world, spot, exact, (v, omega))
    found = fails(world, spot, v, omega)
    ends = np.arange(1, 11) * 0.3
    # Judged where the robot is caught or free for certain, not where a hair decides.
    free, held = nearly > ends + 0.08, caught < ends - 0.08
    assert (found > ends)[free].all()
    assert (found <= ends)[held].all()


def test_deep_in_a_bush_the_way_on_fails_and_the_way_out_takes_its_time(
    world_of: WorldOf, spot: Robot
) -> None:
    deep = world_of(disc(0.9, 0.0, 0.8, "entangles", 0.15))
    assert fails(deep, spot, 0.5) == 0
    assert fails(deep, spot, -0.5) == np.inf


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
def test_grass_delays_the_wall_behind_it(share: float, world_of: WorldOf, spot: Robot) -> None:
    front = spot.footprint.length / 2
    wall = Obstacle((front + 0.3 + 0.1, -4.0), (front + 0.3 + 0.1, 4.0), 0.1, "stops", "concrete")
    grass = disc(0.0, 0.0, 5.0, "slows", share)
    assert fails(world_of(wall, grass), spot, 0.5) == pytest.approx(0.3 / 0.5 / share, abs=0.06)


def test_a_robot_that_is_asked_to_stand_does_not_fail(world_of: WorldOf, spot: Robot) -> None:
    deep = world_of(disc(0.9, 0.0, 0.8, "entangles", 0.1), disc(0.0, 0.4, 0.15, "stops"))
    assert fails(deep, spot, 0.0) == np.inf
