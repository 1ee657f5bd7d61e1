"""Both dynamic window planners, driven in a plane with posts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.robot import Footprint, Limits, Robot
from planners.arc_distance import free_way
from planners.body_discs import BodySettings, body_discs
from planners.dwa_fox import DwaFox
from planners.dwa_lab import DwaLab
from planners.fox_objective import FoxWeights, fox_objective
from planners.goal import goal_in_base, heading_error
from planners.situation import Planner, Situation
from planners.velocity_window import VelocityWindowSettings, velocity_window
from tests.planners.conftest import Situations

Floats = NDArray[np.float64]
LIMITS = Limits(linear_velocity=(0.0, 0.6), yaw_rate=(-0.6, 0.6))
PERIOD_S = 0.1
SPOT = Footprint(length=1.1, width=0.5)


class Posts:
    """Obstacles that stand in the odometry frame, seen as points on their outlines."""

    def __init__(self, *posts: tuple[float, float, float]) -> None:
        self.posts = np.array(posts, np.float64).reshape(-1, 3)

    sees_behind = True

    def points(self, situation: Situation) -> Floats:
        around = np.linspace(0, 2 * np.pi, 60)
        outline = np.stack((np.cos(around), np.sin(around)), axis=1)
        world = (self.posts[:, None, :2] + self.posts[:, None, 2:] * outline).reshape(-1, 2)
        x, y, yaw = situation.pose
        cosine, sine = np.cos(yaw), np.sin(yaw)
        return np.asarray((world - (x, y)) @ np.array([[cosine, -sine], [sine, cosine]]))


def drive(planner: Planner, ask: Situations, goal: tuple[float, float], seconds: float) -> Floats:
    """Poses (N, 3) of a robot that accelerates within its limits."""
    pose, velocity = np.zeros(3), np.zeros(2)
    path = [pose]
    for _ in range(round(seconds / PERIOD_S)):
        x, y, yaw = pose.tolist()
        v, omega = velocity.tolist()
        command = planner.command(ask(pose=(x, y, yaw), velocity=(v, omega), goal=goal))
        moment = np.array([command.linear_velocity, command.yaw_rate])
        velocity = velocity + np.clip(moment - velocity, (-0.1, -0.32), (0.1, 0.32))
        heading = yaw + velocity[1] * PERIOD_S / 2
        way = velocity[0] * PERIOD_S
        step = (way * np.cos(heading), way * np.sin(heading), velocity[1] * PERIOD_S)
        pose = pose + step
        path.append(pose)
        if np.hypot(*(pose[:2] - goal)) < 0.5:
            break
    return np.array(path)


MAKERS: list[Callable[[Robot, Posts], Planner]] = [DwaFox, DwaLab]


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("goal", [(5.0, 0.0), (3.0, 3.0), (-4.0, 1.0)])
def test_reaches_a_goal_in_the_open(
    make: Callable[[Robot, Posts], Planner],
    robot: Robot,
    situation: Situations,
    goal: tuple[float, float],
) -> None:
    path = drive(make(robot, Posts()), situation, goal, 25)
    assert np.hypot(*(path[-1, :2] - goal)) < 0.5


@pytest.mark.parametrize("goal", [(0.0, 2.0), (0.4, -1.5), (-0.5, 1.2)])
def test_a_robot_that_turns_slowly_does_not_circle_its_goal(
    robot: Robot, situation: Situations, goal: tuple[float, float]
) -> None:
    limits = robot.limits.model_copy(update={"yaw_rate": (-0.35, 0.35)})
    slow = robot.model_copy(update={"limits": limits})
    path = drive(DwaFox(slow, Posts()), situation, goal, 25)
    assert np.hypot(*(path[-1, :2] - goal)) < 0.5


@pytest.mark.parametrize("make", MAKERS)
def test_goes_around_a_post(
    make: Callable[[Robot, Posts], Planner], robot: Robot, situation: Situations
) -> None:
    path = drive(make(robot, Posts((3.0, 0.05, 0.2))), situation, (6.0, 0.0), 25)
    assert np.hypot(*(path[-1, :2] - (6.0, 0.0))) < 0.5
    assert np.hypot(*(path[:, :2] - (3.0, 0.05)).T).min() > 0.2 + robot.footprint.width / 2


@pytest.mark.parametrize("make", MAKERS)
def test_never_drives_into_a_wall(
    make: Callable[[Robot, Posts], Planner], robot: Robot, situation: Situations
) -> None:
    wall = Posts(*((3.0, y, 0.1) for y in np.arange(-4, 4.1, 0.15).tolist()))
    path = drive(make(robot, wall), situation, (6.0, 0.0), 12)
    front = path[:, 0] + np.cos(path[:, 2]) * robot.footprint.length / 2
    assert front.max() < 2.9
    assert path[:, 0].max() > 1.8


@pytest.mark.parametrize("make", MAKERS)
def test_surrounded_it_does_not_drive_on(
    make: Callable[[Robot, Posts], Planner], robot: Robot, situation: Situations
) -> None:
    angles = np.linspace(0, 2 * np.pi, 40)
    ring = Posts(*((0.57 * np.cos(a), 0.57 * np.sin(a), 0.02) for a in angles.tolist()))
    command = make(robot, ring).command(situation(velocity=(0.0, 0.0)))
    assert command.linear_velocity == 0
    assert command.reason
    assert command.considered is not None
    assert command.considered.chosen is None


@pytest.mark.parametrize("make", MAKERS)
def test_a_command_is_one_of_what_was_considered(
    make: Callable[[Robot, Posts], Planner], robot: Robot, situation: Situations
) -> None:
    command = make(robot, Posts((3.0, 0.3, 0.2))).command(situation())
    considered = command.considered
    assert considered is not None
    assert considered.chosen is not None
    chosen = considered.velocities[considered.chosen].tolist()
    assert chosen == [command.linear_velocity, command.yaw_rate]
    assert considered.objective.max() == considered.objective[considered.chosen]


def test_the_goal_in_base_link(situation: Situations) -> None:
    moment = situation(pose=(1.0, 2.0, np.pi / 2), goal=(1.0, 5.0))
    assert goal_in_base(moment) == pytest.approx([3.0, 0.0])
    assert heading_error(np.array([0.0, 0.0, 0.5]), np.array([3.0, 0.0])) == pytest.approx(-0.5)


def _terms(weights: FoxWeights, posts: Posts, ask: Situations) -> tuple[Floats, Floats]:
    moment = ask(velocity=(0.3, 0.0), goal=(0.0, 8.0))
    window = velocity_window(LIMITS, moment.velocity, VelocityWindowSettings())
    body = body_discs(SPOT, BodySettings())
    way = free_way(window.velocities, posts.points(moment), body)
    goal = goal_in_base(moment)
    return window.velocities, fox_objective(window, way, goal, LIMITS, 0.5, weights)


def test_each_term_is_within_0_and_1_and_does_what_it_says(situation: Situations) -> None:
    only = {"heading": 0.0, "distance": 0.0, "velocity": 0.0, "smoothing": 0.0}
    posts = Posts((2.0, 0.0, 0.2))
    for name in ("heading", "distance", "velocity"):
        weights = FoxWeights.model_validate({**only, name: 1.0})
        velocities, value = _terms(weights, posts, situation)
        assert value.min() >= 0
        assert value.max() <= 1
        best = velocities[np.argmax(value)]
        if name == "heading":
            assert best[1] == pytest.approx(0.6)
        elif name == "velocity":
            assert best[0] == pytest.approx(0.6)
        else:
            assert value[(velocities[:, 1] == 0) & (velocities[:, 0] > 0)].max() < value.max()


def test_free_way_beyond_the_goal_does_not_count(situation: Situations) -> None:
    only = FoxWeights(heading=0, distance=1, velocity=0, smoothing=0)
    moment = situation(velocity=(0.3, 0.0), goal=(0.0, 1.2))
    window = velocity_window(LIMITS, moment.velocity, VelocityWindowSettings())
    way = free_way(window.velocities, np.empty((0, 2)), body_discs(SPOT, BodySettings()))
    value = fox_objective(window, way, goal_in_base(moment), LIMITS, 0.5, only)
    np.testing.assert_allclose(value, 1.2 / only.longest_distance)


def test_smoothing_keeps_a_constant_and_spreads_a_dent(situation: Situations) -> None:
    flat = FoxWeights(heading=0, distance=1, velocity=0, smoothing=2.0)
    velocities, value = _terms(flat, Posts(), situation)
    sharp = _terms(flat.model_copy(update={"smoothing": 0.0}), Posts(), situation)[1]
    moving = velocities[:, 0] > 0.35
    assert sharp[moving] == pytest.approx(1.0)
    assert value.max() <= 1 + 1e-12
    blocked = Posts((2.0, 0.9, 0.1))
    rough = _terms(flat.model_copy(update={"smoothing": 0.0}), blocked, situation)[1]
    smooth = _terms(flat, blocked, situation)[1]
    beside = (rough == 1.0) & moving
    assert smooth[beside].min() < 0.95
