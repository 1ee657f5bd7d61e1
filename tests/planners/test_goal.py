"""A robot stops at its goal and where it gets no nearer, and goes on with another goal."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import pytest

from graspe_data.robot import Limits
from planners.fitness import GuardSettings
from planners.goal import GoalSettings, GoalWatch
from planners.guarded import Guarded
from planners.situation import Command, Situation
from tests.planners.conftest import NOW
from tests.planners.every_planner import SECOND, seen_anew, sound

LIMITS = Limits(linear_velocity=(0.0, 0.6), yaw_rate=(-0.6, 0.6))
SETTINGS = GoalSettings(radius=0.5, progress_m=0.5, progress_s=10.0)
GUARD = GuardSettings(needs_picture=False, goal=SETTINGS, answer_s=30.0)
PERIOD_NS = SECOND // 10


@dataclass
class Aims:
    """Drives at the goal, with a least speed and a bounded turn: it circles what it passes."""

    def command(self, situation: Situation) -> Command:
        x, y, yaw = situation.pose
        error = math.atan2(situation.goal[1] - y, situation.goal[0] - x) - yaw
        turn = (error + math.pi) % (2 * math.pi) - math.pi
        return Command(0.3, max(-0.6, min(0.6, turn)))


def driven(
    guarded: Guarded, goal: tuple[float, float], seconds: float, *, held: bool = False
) -> Iterator[tuple[Situation, Command]]:
    """The robot obeys; or it is held where it is."""
    pose, velocity = (0.0, 0.0, 0.0), (0.0, 0.0)
    for step in range(round(seconds * 10)):
        seen = seen_anew(sound(NOW + step * PERIOD_NS), step)
        moment = replace(
            seen, pose=pose, velocity=velocity, goal=goal, picture=None, odometry_ns=seen.now_ns
        )
        command = guarded.command(moment)
        yield moment, command
        if not held:
            velocity = (command.linear_velocity, command.yaw_rate)
            x, y, yaw = pose
            v, omega = velocity
            pose = (x + 0.1 * v * math.cos(yaw), y + 0.1 * v * math.sin(yaw), yaw + 0.1 * omega)


@pytest.mark.parametrize("goal", [(3.0, 0.0), (1.0, 2.0), (-2.0, 0.5)])
def test_it_stands_within_the_radius(goal: tuple[float, float]) -> None:
    *_, (moment, command) = driven(Guarded(Aims(), LIMITS, GUARD), goal, 30)
    assert math.dist(moment.pose[:2], goal) <= SETTINGS.radius
    assert moment.velocity == (0.0, 0.0)
    assert (command.linear_velocity, command.yaw_rate) == (0.0, 0.0)
    assert command.arrived
    assert "arrived" in command.reason


def test_a_robot_that_is_held_is_given_up_and_says_so() -> None:
    commands = [each for _, each in driven(Guarded(Aims(), LIMITS, GUARD), (8, 0), 12, held=True)]
    first = next(row for row, command in enumerate(commands) if command.reason)
    assert first == pytest.approx(100, abs=1)
    assert "no progress" in commands[-1].reason
    assert not commands[-1].arrived
    assert commands[-1].linear_velocity == 0.0


def test_one_that_circles_is_given_up() -> None:
    class Circles:
        def command(self, situation: Situation) -> Command:
            del situation
            return Command(0.3, 0.6)

    *_, (_, command) = driven(Guarded(Circles(), LIMITS, GUARD), (8.0, 0.0), 20)
    assert "no progress" in command.reason


def test_one_that_gets_on_slowly_is_not() -> None:
    watch = GoalWatch(SETTINGS)
    for step in range(400):
        moment = replace(sound(NOW + step * PERIOD_NS), pose=(0.006 * step, 0.0, 0.0))
        assert watch.standing(moment) is None


def test_another_goal_begins_anew_and_a_little_drift_does_not() -> None:
    watch, at = GoalWatch(SETTINGS), replace(sound(), pose=(7.8, 0.0, 0.0))
    assert watch.standing(at) is not None
    pushed = replace(at, pose=(7.2, 0.0, 0.0))
    assert watch.standing(pushed) is not None
    assert watch.standing(replace(pushed, goal=(8.1, 0.0))) is not None
    assert watch.standing(replace(at, pose=(6.9, 0.0, 0.0))) is None
    assert watch.standing(at) is not None
    assert watch.standing(replace(at, goal=(12.0, 0.0))) is None


def test_pauses_do_not_count() -> None:
    watch = GoalWatch(SETTINGS)
    for step in range(9):
        assert watch.standing(sound(NOW + step * 3600 * SECOND)) is None


def test_time_without_fit_data_does_not_count() -> None:
    guarded = Guarded(Aims(), LIMITS, GUARD)
    for step in range(300):
        blind = replace(sound(NOW + step * PERIOD_NS), cloud=None)
        assert "no cloud" in guarded.command(blind).reason
    assert guarded.command(sound(NOW + 31 * SECOND)).reason == ""
