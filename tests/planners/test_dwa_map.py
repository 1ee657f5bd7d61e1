"""The dynamic window on a cost map: closed forms, properties, bad input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.robot import Limits, Robot
from planners.body_discs import BodySettings, body_discs
from planners.cost_map import CostMap
from planners.dwa_map import DwaMap, MapDwaSettings
from planners.fitness import GuardSettings
from planners.guarded import Guarded
from planners.intensity_source import IntensitySource
from planners.map_roll_outs import MapRollOuts
from planners.situation import Situation
from tests.planners.conftest import NOW, Situations

CELLS, CELL_M = 200, 0.05
LIMITS = Limits(linear_velocity=(0.0, 0.6), yaw_rate=(-0.6, 0.6))
ORIGIN = (0.0, 0.0, 0.0)


def at(low: tuple[float, float], high: tuple[float, float]) -> NDArray[np.bool_]:
    """The cells whose centres lie in a rectangle, metres."""
    centres = (CELLS / 2 - 0.5 - np.arange(CELLS)) * CELL_M
    x, y = centres[:, None], centres[None, :]
    return np.asarray((x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1]))


def walls(*solid: NDArray[np.bool_], soft: float = 0.0) -> CostMap:
    """Barred cells of cost 1, and all others of one cost."""
    barred = np.logical_or.reduce([np.zeros((CELLS, CELLS), np.bool_), *solid])
    cost = np.where(barred, 1.0, soft).astype(np.float32)
    return CostMap(cost, barred, barred, CELL_M, ORIGIN, NOW)


class Shows:
    """A source that shows one map."""

    def __init__(self, seen: CostMap) -> None:
        self.seen = seen

    def cost_map(self, situation: Situation) -> CostMap:  # noqa: ARG002
        return self.seen


@pytest.fixture
def ground(robot: Robot) -> MapRollOuts:
    return on(walls(at((1.5, -6.0), (2.0, 6.0))), robot)


def on(seen: CostMap, robot: Robot) -> MapRollOuts:
    body = body_discs(robot.footprint, BodySettings(count=5, margin=0.0))
    return MapRollOuts(seen, ORIGIN, robot.footprint, body)


def test_the_sum_is_the_cells_that_the_foremost_disc_runs_over(ground: MapRollOuts) -> None:
    # The disc's middle, 0.44 m ahead, goes from 0.44 to 2.24 m: through all of the wall's 10 rows
    # and all but the part of the disc that has not left it.
    through, short, still = ground.cost(np.array([[0.6, 0.0], [0.2, 0.0], [0.0, 0.5]]), 3.0, 60)
    assert through == pytest.approx(10, abs=0.6)
    assert short == 0
    assert still == 0


def test_a_map_of_one_cost_is_charged_by_the_way(robot: Robot) -> None:
    charged = on(walls(soft=0.3), robot).cost(np.array([[0.6, 0.0], [0.3, 0.4]]), 2.0, 20)
    assert charged == pytest.approx([0.3 * 1.2 / CELL_M, 0.3 * 0.6 / CELL_M], rel=1e-5)


def test_what_is_beside_the_robot_counts_within_its_berth(robot: Robot) -> None:
    body = body_discs(robot.footprint, BodySettings(count=5, margin=0.0))
    post = walls(at((1.4, 0.35), (1.6, 0.55)))
    straight = np.array([[0.6, 0.0]])
    narrow, wide = (
        MapRollOuts(post, ORIGIN, robot.footprint, body, berth=berth).cost(straight, 3.0, 60)
        for berth in (0.0, 0.3)
    )
    assert narrow == 0
    # Each of the post's 4 x 4 cells counts for as long as the wide disc is over it, per cell of the
    # body's own disc.
    disc, aside = (0.273 + 0.3) / CELL_M, np.array([7.5, 8.5, 9.5, 10.5])
    over = 2 * np.sqrt(disc**2 - aside**2)
    assert wide == pytest.approx(4 * over.sum() / (np.pi * (0.273 / CELL_M) ** 2), rel=0.2)


def test_a_roll_out_keeps_off_barred_cells_by_the_margin(robot: Robot) -> None:
    # Nose disc: 0.44 m ahead, radius 0.273 m; in 3 s it comes 1.8 m further.
    body = body_discs(robot.footprint, BodySettings(count=5, margin=0.0))
    fast, slow = np.array([[0.6, 0.0]]), np.array([[0.1, 0.0]])
    for gap, expected in ((2.1, True), (1.85, False), (1.7, False)):
        edge = 0.44 + 0.273 + gap
        seen = walls(at((edge, -6.0), (edge + 1, 6.0)))
        ground = MapRollOuts(seen, ORIGIN, robot.footprint, body, margin=0.15)
        assert ground.free(fast, 3.0, 30).tolist() == [expected]
        assert ground.free(slow, 3.0, 30).tolist() == [True]


def test_there_is_room_while_the_robot_can_stop_before_the_wall(robot: Robot) -> None:
    # Nose disc: 0.44 m ahead, radius 0.273 m. At 0.6 m/s the robot needs 0.12 + 0.18 m to stand.
    fast = np.array([[0.6, 0.0]])
    for gap, expected in ((0.5, True), (0.2, False)):
        edge = 0.44 + 0.273 + gap
        seen = on(walls(at((edge, -6.0), (edge + 1, 6.0))), robot)
        assert seen.room(fast, LIMITS, 0.2).tolist() == [expected]
        assert seen.room(np.array([[0.1, 0.0]]), LIMITS, 0.2).tolist() == [True]


def test_cells_under_the_robot_do_not_hold_it(robot: Robot) -> None:
    seen = on(walls(at((-0.5, -0.2), (0.5, 0.2))), robot)
    moves = np.array([[0.6, 0.0], [0.0, 0.6]])
    assert seen.room(moves, LIMITS, 0.2).all()
    assert seen.free(moves, 3.0, 30).all()


def test_inflation_about_the_robot_does_not_hold_it_either(robot: Robot) -> None:
    beside = walls(at((-0.5, -0.38), (0.5, 0.38)))
    inflated = replace(beside, solid=np.zeros_like(beside.solid))
    assert on(inflated, robot).free(np.array([[0.6, 0.0]]), 3.0, 30).all()
    assert not on(beside, robot).free(np.array([[0.6, 0.0]]), 3.0, 30).any()


def test_the_map_stays_where_it_was_taken(robot: Robot) -> None:
    wall, shape = walls(at((1.5, -6.0), (2.0, 6.0))), robot.footprint
    body = body_discs(shape, BodySettings())
    straight = np.array([[0.6, 0.0]])
    aside = MapRollOuts(wall, (0.0, 0.0, np.pi / 2), shape, body)
    assert aside.cost(straight, 3.0, 30) == pytest.approx(0, abs=1e-9)
    near = MapRollOuts(wall, (0.6, 0.0, 0.0), shape, body)
    assert near.cost(straight, 3.0, 30) > 0
    assert not near.free(straight, 3.0, 30).all()


def test_it_drives_to_the_goal_on_an_empty_map(robot: Robot, situation: Situations) -> None:
    command = DwaMap(robot, Shows(walls())).command(situation(velocity=(0.5, 0.0)))
    assert (command.linear_velocity, command.yaw_rate, command.reason) == (0.6, 0.0, "")


def test_it_turns_to_the_gap(robot: Robot, situation: Situations) -> None:
    gap = (at((1.6, -6.0), (1.8, 0.3)), at((1.6, 1.9), (1.8, 6.0)))
    command = DwaMap(robot, Shows(walls(*gap))).command(situation(velocity=(0.5, 0.0)))
    assert command.linear_velocity > 0
    assert command.yaw_rate > 0.1


def test_it_does_not_drive_into_a_wall_but_turns(robot: Robot, situation: Situations) -> None:
    shut = Shows(walls(at((0.7, -6.0), (1.2, 6.0))))
    command = DwaMap(robot, shut).command(situation(velocity=(0.6, 0.0)))
    assert command.linear_velocity == 0
    assert command.yaw_rate != 0
    assert "turning on the spot" in command.reason


def test_shut_in_it_stops(robot: Robot, situation: Situations) -> None:
    hollow = walls(~at((-0.72, -0.24), (0.72, 0.24)))
    command = DwaMap(robot, Shows(hollow)).command(situation(velocity=(0.6, 0.0)))
    assert (command.linear_velocity, command.yaw_rate) == (0, 0)
    assert command.reason == "all roll-outs meet barred cells: stop"


def test_where_it_can_neither_keep_off_nor_turn_it_crawls_on(
    robot: Robot, situation: Situations
) -> None:
    alley = Shows(walls(~at((-6.0, -0.31), (6.0, 0.31))))
    slow = MapDwaSettings(reaction_s=1.0)
    command = DwaMap(robot, alley, slow).command(situation(velocity=(0.0, 0.0)))
    assert command.reason == "all roll-outs meet barred cells: crawling on"
    assert command.linear_velocity == pytest.approx(0.1)


@pytest.mark.parametrize("fastest", [0.0, -0.4])
def test_a_robot_that_cannot_drive_ahead_is_told_something_all_the_same(
    robot: Robot, situation: Situations, fastest: float
) -> None:
    limits = robot.limits.model_copy(update={"linear_velocity": (min(fastest, 0.0), 0.0)})
    other = robot.model_copy(update={"limits": limits})
    for seen in (walls(), walls(at((0.7, -6.0), (1.2, 6.0))), walls(~at((-0.7, -0.3), (0.7, 0.3)))):
        command = DwaMap(other, Shows(seen)).command(situation(velocity=(0.0, 0.0)))
        assert fastest <= command.linear_velocity <= 0


def test_a_goal_that_is_no_number_stops_it(robot: Robot, situation: Situations) -> None:
    lost = replace(situation(velocity=(0.3, 0.0)), goal=(float("nan"), 1.0))
    command = DwaMap(robot, Shows(walls())).command(lost)
    assert (command.linear_velocity, command.yaw_rate) == (0, 0)
    assert "no number" in command.reason


def test_no_speed_jumps_a_wall(robot: Robot) -> None:
    thin = on(walls(at((2.0, -6.0), (2.1, 6.0))), robot)
    speeds = np.array([[v, 0.0] for v in (6.0, 9.5, 12.0, 15.0, 19.0)])
    assert not thin.room(speeds, LIMITS, 0.2).any()


def test_pliable_cells_are_driven_through(robot: Robot, situation: Situations) -> None:
    cost = np.where(at((1.0, -1.0), (1.6, 1.0)), np.float32(0.15), np.float32(0))
    free = np.zeros((CELLS, CELLS), np.bool_)
    grass = CostMap(cost, free, free, CELL_M, ORIGIN, NOW)
    command = DwaMap(robot, Shows(grass)).command(situation(velocity=(0.5, 0.0)))
    assert command.linear_velocity == pytest.approx(0.6)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_more_cost_never_makes_an_arc_better(robot: Robot, seed: int) -> None:
    drawn = np.random.default_rng(seed)
    low = drawn.random((40, 40), np.float32) * (drawn.random((40, 40)) < 0.2)
    high = np.maximum(low, drawn.random((40, 40), np.float32) * (drawn.random((40, 40)) < 0.1))
    velocities = drawn.uniform((0.0, -0.6), (0.6, 0.6), (20, 2))
    sums, free = [], []
    for cost in (low, high):
        seen = CostMap(cost, cost > 0.5, cost > 0.5, 0.1, ORIGIN, NOW)
        sums.append(on(seen, robot).cost(velocities, 3.0, 30))
        free.append(on(seen, robot).free(velocities, 3.0, 30))
    assert (sums[1] >= sums[0] - 1e-5).all()
    assert (free[0] | ~free[1]).all()


def test_bad_clouds_stop_the_robot_with_a_reason(robot: Robot, situation: Situations) -> None:
    source = IntensitySource(robot, Transform(np.eye(3), np.array([0.2, 0.0, 0.35])))
    guard = GuardSettings(needs_picture=False)
    guarded = Guarded(DwaMap(robot, source, MapDwaSettings()), robot.limits, guard)
    moment = situation(velocity=(0.05, 0.0))
    assert moment.cloud is not None
    dark = replace(moment.cloud, intensity=np.zeros(len(moment.cloud.xyz), np.float32))
    for cloud, reason in (
        (None, "there is no cloud"),
        (moment.cloud, "stop: no planning map: The cloud has no intensity"),
        (dark, "intensities are 0"),
    ):
        command = guarded.command(replace(moment, cloud=cloud))
        assert (command.linear_velocity, command.yaw_rate) == (0, 0)
        assert reason in command.reason
