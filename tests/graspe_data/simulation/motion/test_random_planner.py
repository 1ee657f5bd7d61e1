"""The randomised planner: where it goes, what it looks at, and what it does when it is held."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from pydantic import ValidationError

from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drive_robot import drive_robot
from graspe_data.simulation.motion.drivers import Leg, RobotState, ScriptedDriver
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.motion.planner_settings import PlannerSettings
from graspe_data.simulation.motion.random_planner import RandomPlanner
from graspe_data.simulation.world.obstacles import Obstacle
from graspe_data.simulation.world.world import World

WorldOf = Callable[..., World]


def explored(world: World, robot: Robot, settings: PlannerSettings, seconds: float) -> Drive:
    generator = np.random.default_rng(5)
    planner = RandomPlanner(world, robot, settings, generator.spawn(1)[0])
    return drive_robot(world, robot, planner, MotionSettings(), seconds, generator)


def trees(count: int, radius: float = 0.2) -> list[Obstacle]:
    drawn = np.random.default_rng(11)
    centres = drawn.uniform((-20.0, -15.0), (20.0, 15.0), (count, 2))
    centres = centres[np.hypot(*centres.T) > 2.0]
    return [Obstacle((x, y), (x, y), radius, "stops", "bark") for x, y in centres.tolist()]


def test_it_stays_in_the_arena_and_gets_around(world_of: WorldOf, spot: Robot) -> None:
    drive = explored(world_of(), spot, PlannerSettings(), 120.0)
    low, high = np.reshape(world_of().arena, (2, 2))
    assert (drive.position[:, :2] > low).all()
    assert (drive.position[:, :2] < high).all()
    assert np.ptp(drive.position[:, :2], axis=0).max() > 8.0
    assert np.abs(np.diff(drive.position[:, :2], axis=0)).sum() > 30.0


def test_its_commands_on_free_ground_lie_within_the_robots_limits(
    world_of: WorldOf, spot: Robot
) -> None:
    v, omega = explored(world_of(), spot, PlannerSettings(), 60.0).command.T
    assert v.min() >= spot.limits.linear_velocity[0]
    assert v.max() <= spot.limits.linear_velocity[1]
    assert np.abs(omega).max() <= spot.limits.yaw_rate[1]


def test_commands_are_held_for_ten_steps_at_least(world_of: WorldOf, spot: Robot) -> None:
    drive = explored(world_of(), spot, PlannerSettings(), 30.0)
    changes = np.flatnonzero((np.diff(drive.command, axis=0) != 0).any(axis=1)) + 1
    assert (changes % 10 == 0).all()


def test_a_cautious_robot_hits_less(world_of: WorldOf, spot: Robot) -> None:
    world = world_of(*trees(250))
    careful, blind = (
        explored(world, spot, PlannerSettings(caution=caution, curiosity=0.0), 120.0).contacts
        for caution in (1.0, 0.0)
    )
    hits = [np.count_nonzero(contacts.impact > 0.1) for contacts in (careful, blind)]
    assert 3 * hits[0] <= hits[1]
    assert hits[1] >= 3


def test_a_curious_robot_finds_what_holds_it(world_of: WorldOf, spot: Robot) -> None:
    world = world_of(*trees(60))
    curious, steady = (
        explored(world, spot, PlannerSettings(caution=1.0, curiosity=curiosity), 120.0).contacts
        for curiosity in (1.0, 0.0)
    )
    hits = [np.count_nonzero(contacts.impact > 0.1) for contacts in (curious, steady)]
    assert hits[0] >= 3
    assert 3 * hits[1] <= hits[0]


def test_held_by_a_wall_it_pushes_backs_off_and_turns(world_of: WorldOf, spot: Robot) -> None:
    wall = Obstacle((2.0, -14.0), (2.0, 14.0), 0.1, "stops", "concrete")
    settings = PlannerSettings(caution=0.0, curiosity=0.0, stand=0.0, turn=0.0, oscillate=0.0)
    drive = explored(world_of(wall), spot, settings, 60.0)
    backs = int(np.argmax(drive.command[:, 0] < 0))
    assert (drive.contacts.impact[:backs] > 0.1).any()
    pushing = slice(backs - 150, backs)
    assert (drive.command[pushing] == drive.command[backs - 1]).all()
    assert drive.command[backs - 1, 0] > 0
    assert drive.contacts.stopped[pushing].mean() > 0.9
    low, high = settings.back_speed
    assert -high <= drive.command[backs, 0] <= -low
    turns = backs + int(np.argmax(drive.command[backs:, 0] == 0))
    assert 0.9 <= (turns - backs) * 0.01 <= 2.6
    assert abs(drive.command[turns, 1]) >= settings.turn_rate[0]


def test_the_same_generator_plans_the_same(world_of: WorldOf, spot: Robot) -> None:
    world = world_of(*trees(40))
    first, second = (explored(world, spot, PlannerSettings(), 40.0) for _ in range(2))
    assert first.command.tobytes() == second.command.tobytes()


def test_limits_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ValidationError, match=r"hold_s: the lower limit 4.0 is above"):
        PlannerSettings(hold_s=(4.0, 1.0))


def test_a_script_is_driven_leg_by_leg_and_then_stands() -> None:
    driver = ScriptedDriver([Leg(1.0, 0.5, 0.1), Leg(0.5, -0.2, 0.0)])
    states = [RobotState(time, (0.0, 0.0, 0.0), (0.0, 0.0)) for time in (0.0, 0.9, 1.0, 1.4, 1.5)]
    commands = [driver.command(state) for state in states]
    assert commands == [(0.5, 0.1), (0.5, 0.1), (-0.2, 0.0), (-0.2, 0.0), (0.0, 0.0)]
