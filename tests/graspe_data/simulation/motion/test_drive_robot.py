"""A robot that drives: free, stopped, held, slowed, thrown, and what its sensors feel of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.observation.trajectory import constant_velocity_arc
from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import STEP_S, Drive
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.motion.footprint import clearance
from graspe_data.simulation.motion.mechanics import MechanicsSettings, SlipSettings
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.motion.wheel_odometry import OdometrySettings
from graspe_data.simulation.world.obstacles import Obstacle, Obstacles
from graspe_data.simulation.world.world import Ground, World

WorldOf = Callable[..., World]
DriveOf = Callable[..., Drive]

WALL = Obstacle((3.0, -5.0), (3.0, 5.0), 0.1, "stops", "concrete")
TREE = Obstacle((3.0, 0.1), (3.0, 0.1), 0.2, "stops", "bark")
BUSH = Obstacle((3.0, 0.0), (3.0, 0.0), 1.0, "entangles", "bush", 0.2)
GRASS = Obstacle((2.0, 0.0), (8.0, 0.0), 1.0, "slows", "grass", 0.6)
ROCK = Obstacle((2.0, 0.0), (2.0, 0.0), 0.15, "stumbles", "rock", 0.15)

legs = st.builds(Leg, st.floats(0.3, 3.0), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))


def at(seconds: float) -> int:
    return round(seconds / STEP_S)


@settings(max_examples=30, deadline=None)
@given(script=st.lists(legs, min_size=1, max_size=5))
def test_a_free_robot_changes_its_velocity_no_faster_than_it_can(
    script: list[Leg], world_of: WorldOf, scripted: DriveOf, spot: Robot
) -> None:
    drive = scripted(world_of(), script)
    change = np.abs(np.diff(drive.velocity, axis=0)) / STEP_S
    limits = spot.limits.linear_acceleration, spot.limits.yaw_acceleration
    assert (change <= np.array(limits) + 1e-9).all()
    assert not drive.contacts.stopped.any()
    assert (drive.contacts.speed_share == 1.0).all()


def test_a_start_and_a_stop_take_the_way_of_constant_acceleration(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    drive = scripted(world_of(), [Leg(4.0, 0.5, 0.0), Leg(2.0, 0.0, 0.0)])
    # v t: the half second lost at the start is gained at the stop; both ramps take v / a.
    assert drive.position[-1, 0] == pytest.approx(0.5 * 4.0, abs=1.01 * 0.5 * STEP_S)
    assert drive.position[at(0.5), 0] == pytest.approx(0.5 * 0.5**2, abs=1.01 * 0.5 * STEP_S)


@pytest.mark.parametrize("omega", [-0.5, 0.0, 0.3])
def test_a_constant_velocity_drives_its_arc(
    omega: float, world_of: WorldOf, scripted: DriveOf
) -> None:
    drive = scripted(world_of(start=(1.0, -2.0, 0.7)), [Leg(5.0, 0.6, omega)])
    begun = at(1.0)
    expected = constant_velocity_arc(0.6, omega, 10, 0.3)
    heading = drive.attitude[begun, 2]
    cosine, sine = np.cos(heading), np.sin(heading)
    way = drive.position[begun::30, :2][:11] - drive.position[begun, :2]
    turned = way @ np.array([[cosine, -sine], [sine, cosine]])
    np.testing.assert_allclose(turned, expected[:, :2], atol=1e-9)


def test_a_wall_stops_the_robot_at_once_and_it_stays_in_front_of_it(
    world_of: WorldOf, scripted: DriveOf, spot: Robot
) -> None:
    drive = scripted(world_of(WALL), [Leg(9.0, 0.5, 0.0)])
    gap = 3.0 - 0.1 - spot.footprint.length / 2 - drive.position[:, 0]
    assert gap.min() >= 0.001 - 1e-9
    assert gap[-1] == pytest.approx(0.001, abs=0.0005)
    assert drive.contacts.impact.max() == pytest.approx(0.5)
    assert np.count_nonzero(drive.contacts.impact > 0.1) == 1
    assert drive.contacts.stopped[-100:].mean() > 0.9


def test_an_impact_is_felt_and_the_loss_of_speed_is_its_integral(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    drive = scripted(world_of(WALL), [Leg(7.0, 0.5, 0.0)])
    hit = int(np.argmax(drive.contacts.impact))
    felt = drive.acceleration[hit - 2 : hit + 10, 0]
    change = drive.velocity[hit + 9, 0] - drive.velocity[hit - 3, 0]
    assert felt.sum() * STEP_S == pytest.approx(change, abs=0.01)
    assert np.abs(felt).max() > 15
    assert np.abs(drive.acceleration[: hit - 2, 0]).max() < 1.1


def test_a_turn_that_would_cut_into_a_wall_is_blocked(
    world_of: WorldOf, scripted: DriveOf, spot: Robot
) -> None:
    beside = Obstacle((-5.0, 0.4), (5.0, 0.4), 0.05, "stops", "wood")
    drive = scripted(world_of(beside), [Leg(4.0, 0.0, 0.5)])
    poses = np.column_stack([drive.position[:, :2], drive.attitude[:, 2]])
    gaps = clearance(spot.footprint, poses, Obstacles.of([beside]))
    assert gaps.min() > 0
    assert gaps[-1] < 0.003
    # The corner at half the length and half the width reaches 0.35 m, the fence's side.
    corner = np.hypot(0.55, 0.25)
    expected = np.arcsin(0.35 / corner) - np.arctan2(0.25, 0.55)
    assert drive.attitude[-1, 2] == pytest.approx(expected, abs=0.005)
    assert drive.contacts.stopped[-1]
    assert drive.contacts.impact.max() == 0.0


def test_the_way_back_from_a_wall_is_free(world_of: WorldOf, scripted: DriveOf) -> None:
    drive = scripted(world_of(WALL), [Leg(8.0, 0.5, 0.0), Leg(3.0, -0.4, 0.0)])
    assert drive.velocity[-1, 0] == pytest.approx(-0.4)
    assert drive.position[at(8.0), 0] - drive.position[-1, 0] > 1.0


def test_speed_in_a_bush_falls_by_its_strength_with_the_way_inside(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    drive = scripted(world_of(BUSH), [Leg(8.0, 0.5, 0.0)])
    inside = drive.position[:, 0] + 0.55 - 2.0
    within = inside > 0.02
    expected = 0.5 * np.exp(-inside[within] / 0.2)
    np.testing.assert_allclose(drive.velocity[within, 0], expected, rtol=0.03)
    # dx/dt = v exp(-x / s) has the solution x = s ln(1 + v t / s).
    entered = int(np.argmax(inside > 0))
    since = (np.arange(len(inside)) - entered) * STEP_S
    solution = 0.2 * np.log1p(0.5 * np.maximum(since, 0.0) / 0.2)
    np.testing.assert_allclose(inside[entered:], solution[entered:], atol=0.01)


def test_the_way_out_of_a_bush_is_possible_and_faster_than_the_way_in(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    drive = scripted(world_of(BUSH), [Leg(7.0, 0.5, 0.0), Leg(6.0, -0.4, 0.0)])
    assert drive.velocity[at(7.0) - 1, 0] < 0.1
    assert drive.velocity[at(8.2), 0] <= -0.4 * 0.4 + 1e-9
    assert not drive.contacts.entangled[-1]
    assert drive.velocity[-1, 0] == pytest.approx(-0.4)


def test_tall_grass_leaves_its_share_of_the_speed(world_of: WorldOf, scripted: DriveOf) -> None:
    drive = scripted(world_of(GRASS), [Leg(8.0, 0.5, 0.0)])
    assert drive.velocity[-1, 0] == pytest.approx(0.6 * 0.5)
    assert drive.contacts.speed_share[-1] == pytest.approx(0.6)
    assert not drive.contacts.entangled.any()


def test_a_rock_throws_the_robot_once_while_it_passes(
    world_of: WorldOf, scripted: DriveOf, exact: MotionSettings
) -> None:
    sure = exact.model_copy(update={"mechanics": MechanicsSettings(stumble_height=0.001)})
    drive = scripted(world_of(ROCK), [Leg(9.0, 0.5, 0.0)], sure)
    starts = np.diff(drive.contacts.stumbling.astype(int), prepend=0) == 1
    assert np.count_nonzero(starts) == 1
    touched = drive.position[np.argmax(starts), 0]
    assert touched == pytest.approx(2.0 - 0.15 - 0.55, abs=0.01)
    assert drive.contacts.stumbling.sum() * STEP_S == pytest.approx(0.4)
    tilt = np.hypot(drive.attitude[:, 0], drive.attitude[:, 1])
    assert tilt.max() == pytest.approx(0.3, abs=0.01)
    assert np.hypot(drive.gyro[:, 0], drive.gyro[:, 1]).max() > 1.5
    assert drive.velocity[at(1.0) : at(9.0), 0].min() == pytest.approx(0.3, abs=0.06)


def test_the_body_lies_along_a_slope(world_of: WorldOf, scripted: DriveOf, spot: Robot) -> None:
    rise = 0.1
    heights = np.tile(np.linspace(-5.0, 5.0, 101) * rise, (101, 1))
    hill = world_of(ground=Ground(heights, (-5.0, -5.0), 0.1))
    drive = scripted(hill, [Leg(5.0, 0.5, 0.0)])
    still = at(4.0)
    assert drive.attitude[still, 1] == pytest.approx(-np.arctan(rise), abs=1e-3)
    expected = drive.position[still, 0] * rise + spot.base_height
    assert drive.position[still, 2] == pytest.approx(expected, abs=1e-3)
    # Gravity along x of a body whose nose is up.
    assert drive.acceleration[still, 0] == pytest.approx(9.81 * np.sin(np.arctan(rise)), abs=0.05)
    across = scripted(world_of(ground=hill.ground, start=(0.0, 0.0, np.pi / 2)), [Leg(5, 0.5, 0)])
    assert across.attitude[still, 0] == pytest.approx(-np.arctan(rise), abs=1e-3)


def test_without_errors_the_odometry_is_the_way_from_the_start(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    drive = scripted(world_of(), [Leg(4.0, 0.5, 0.4), Leg(3.0, -0.3, -0.5)])
    np.testing.assert_allclose(drive.odometry[:, :2], drive.position[:, :2], atol=1e-5)
    np.testing.assert_allclose(drive.odometry[:, 2], drive.attitude[:, 2], atol=1e-9)
    np.testing.assert_array_equal(drive.measured, drive.velocity)


def test_slip_loses_speed_and_the_odometry_sees_a_part_of_it(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    slippery = MotionSettings(
        slip=SlipSettings(mean=0.2, spread=0.0),
        odometry=OdometrySettings(
            scale=0.0, speed_noise=0.0, yaw_rate_noise=0.0, yaw_walk=0.0, slip_seen=0.25
        ),
    )
    drive = scripted(world_of(), [Leg(4.0, 0.5, 0.0)], slippery)
    assert drive.velocity[-1, 0] == pytest.approx(0.8 * 0.5)
    assert drive.measured[-1, 0] == pytest.approx(0.95 * 0.5)


def test_the_gait_is_felt_but_is_no_shock(world_of: WorldOf, scripted: DriveOf) -> None:
    drive = scripted(world_of(), [Leg(20.0, 0.5, 0.0)], MotionSettings())
    beyond = drive.acceleration[at(2.0) : at(19.0)] - (0.0, 0.0, 9.81)
    assert 0.5 < np.abs(beyond).max() < 3.0
    assert np.abs(drive.gyro[at(2.0) : at(19.0)]).max() < 0.5


def test_the_same_seed_drives_the_same_and_another_drifts_otherwise(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    world = world_of(TREE, BUSH, GRASS, ROCK)
    first, second, other = (
        scripted(world, [Leg(9.0, 0.5, 0.1)], MotionSettings(), seed) for seed in (1, 1, 2)
    )
    for name in ("position", "attitude", "measured", "odometry", "acceleration", "gyro"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
    assert not np.array_equal(first.odometry, other.odometry)


@settings(max_examples=25, deadline=None)
@given(
    script=st.lists(legs, min_size=2, max_size=6),
    places=st.lists(st.tuples(st.floats(0.9, 3.0), st.floats(-3.1, 3.1)), max_size=8),
)
def test_nothing_solid_is_ever_driven_into(
    script: list[Leg],
    places: list[tuple[float, float]],
    world_of: WorldOf,
    scripted: DriveOf,
    spot: Robot,
) -> None:
    centres = [(r * np.cos(angle), r * np.sin(angle)) for r, angle in places]
    trees = [Obstacle(centre, centre, 0.15, "stops", "bark") for centre in centres]
    drive = scripted(world_of(*trees, WALL), script)
    poses = np.column_stack([drive.position[:, :2], drive.attitude[:, 2]])
    gaps = clearance(spot.footprint, poses, Obstacles.of([*trees, WALL]))
    assert gaps.min() > 0
