"""A drive that is driven step by step is the drive that is driven at once."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from graspe_data.simulation.motion.drive_robot import drive_robot
from graspe_data.simulation.motion.drivers import Leg, ScriptedDriver
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.world.mesh import join_meshes
from graspe_data.simulation.world.obstacles import Obstacle, Obstacles
from graspe_data.simulation.world.world import Ground, World

LEGS = [Leg(2.0, 0.5, 0.2), Leg(3.0, 0.6, -0.2), Leg(1.0, 0.0, 0.5)]
SPOT = load_manifest(find_manifest("robots", "spot"), Robot)
HILLS = Ground(np.random.default_rng(0).uniform(0, 0.1, (20, 20)), (-10.0, -10.0), 1.0)
WORLD = World(
    join_meshes([]),
    (),
    Obstacles.of(
        [
            Obstacle((1.0, 0.1), (1.0, 0.1), 0.1, "stumbles", "rock", 0.15),
            Obstacle((2.8, 0.3), (2.8, 0.3), 0.5, "entangles", "bush", 0.2),
        ]
    ),
    HILLS,
    (-10.0, -10.0, 10.0, 10.0),
    (0.0, 0.0, 0.0),
)


def in_progress(longest_s: float = 6.0, seconds: float = 6.0) -> DriveInProgress:
    driver = ScriptedDriver(LEGS)
    way = DriveInProgress(WORLD, SPOT, MotionSettings(), longest_s, np.random.default_rng(5))
    while not way.over and way.steps < seconds * 100:
        way.advance(driver.command(way.state))
    return way


def assert_alike(one: Drive, other: Drive, rows: slice, tolerance: float = 0.0) -> None:
    for field in fields(Drive):
        if field.name != "contacts":
            a, b = getattr(one, field.name)[rows], getattr(other, field.name)[rows]
            np.testing.assert_allclose(a, b, rtol=0, atol=tolerance, err_msg=field.name)
    for field in fields(one.contacts):
        a, b = (getattr(drive.contacts, field.name)[rows] for drive in (one, other))
        np.testing.assert_array_equal(a, b, err_msg=field.name)


def test_it_is_the_drive_of_a_driver() -> None:
    driven = drive_robot(
        WORLD, SPOT, ScriptedDriver(LEGS), MotionSettings(), 6.0, np.random.default_rng(5)
    )
    assert_alike(in_progress().drive(), driven, slice(None))
    assert driven.contacts.entangled.any()
    assert driven.contacts.stumbling.any()


def test_a_drive_that_ends_sooner_is_the_beginning_of_the_longer_one() -> None:
    short, long = in_progress(seconds=2.0).drive(), in_progress().drive()
    assert len(short.time_s) == 200
    # Tilt and gait look ahead by 0.35 s and, through their derivatives, two steps more.
    assert_alike(short, long, slice(0, 160), 1e-12)
    np.testing.assert_array_equal(short.odometry, long.odometry[:200])
    np.testing.assert_array_equal(short.measured, long.measured[:200])


def test_odometry_so_far_does_not_change_later() -> None:
    way = in_progress(seconds=1.0)
    measured, poses = way.odometry()
    way.advance((0.5, 0.0), 200)
    later, later_poses = way.odometry()
    np.testing.assert_array_equal(later[:100], measured)
    np.testing.assert_array_equal(later_poses[:100], poses)


@settings(max_examples=20, deadline=None)
@given(since=st.integers(0, 590))
def test_a_part_is_that_part_of_the_whole(since: int) -> None:
    way = in_progress()
    whole, part = way.drive(), way.drive(since)
    assert len(part.time_s) == 600 - since
    for name in ("time_s", "velocity", "command", "measured", "odometry"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[since:])
    np.testing.assert_array_equal(part.contacts.impact, whole.contacts.impact[since:])
    settled = slice(40 if since else 0, None)
    np.testing.assert_allclose(part.attitude[settled], whole.attitude[since:][settled], atol=1e-12)
    np.testing.assert_allclose(part.position[settled], whole.position[since:][settled], atol=1e-12)


def test_it_is_over_after_the_longest_time_and_goes_no_further() -> None:
    way = in_progress(longest_s=1.0)
    assert (way.over, way.steps) == (True, 100)
    way.advance((0.5, 0.0), 50)
    assert way.steps == 100
