"""Bad input gives a safe command and a logged reason, never an exception."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from graspe_data.errors import PlannerError
from graspe_data.robot import Limits, Robot
from planners.fitness import GuardSettings
from planners.guarded import Guarded
from planners.situation import Command, Situation
from tests.planners.conftest import NOW, Situations

NAN = float("nan")
LIMITS = Limits(linear_velocity=(0.0, 0.6), yaw_rate=(-0.6, 0.6))


class Answers:
    """A planner that gives what it was told to give."""

    def __init__(self, answer: Command | Exception) -> None:
        self._answer = answer

    def command(self, situation: Situation) -> Command:  # noqa: ARG002
        if isinstance(self._answer, Exception):
            raise self._answer
        return self._answer


def test_a_good_command_passes(situation: Situations) -> None:
    command = Command(0.4, -0.2)
    assert Guarded(Answers(command), LIMITS).command(situation()) is command


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"picture": None}, "there is no picture"),
        ({"cloud": None}, "there is no cloud"),
        ({"now_ns": NOW + 10**9}, "the picture is 1.05 s old, more than 0.5 s"),
        ({"now_ns": NOW - 10**9}, "the picture is 0.95 s in the future"),
        ({"velocity": (NAN, 0.0)}, "the velocity is not finite"),
        ({"pose": (0.0, NAN, 0.0)}, "the pose is not finite"),
        ({"goal": (float("inf"), 0.0)}, "the goal is not finite"),
        ({"velocity": None}, "the velocity is not finite"),
        ({"velocity": "fast"}, "the velocity is no numbers"),
    ],
)
def test_bad_situations(
    situation: Situations,
    changes: dict[str, Any],
    reason: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    moment = replace(situation(velocity=(0.05, 0.0)), **changes)
    with caplog.at_level(logging.WARNING, "planners"):
        command = Guarded(Answers(Command(0.6, 0.0)), LIMITS).command(moment)
    assert (command.linear_velocity, command.yaw_rate) == (0.0, 0.0)
    assert reason in command.reason
    assert command.reason in caplog.messages


def test_a_planner_by_the_lidar_alone_needs_no_picture(situation: Situations) -> None:
    guarded = Guarded(Answers(Command(0.4, 0.0)), LIMITS, GuardSettings(needs_picture=False))
    assert guarded.command(replace(situation(), picture=None)).reason == ""


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (Command(0.7, 0.0), "linear velocity 0.7 is not within 0..0.6"),
        (Command(-0.1, 0.0), "linear velocity -0.1"),
        (Command(0.0, -0.7), "yaw rate -0.7"),
        (Command(NAN, 0.0), "linear velocity nan"),
        (PlannerError("no such thing"), "no such thing"),
        (ZeroDivisionError("by zero"), "ZeroDivisionError: by zero"),
    ],
)
def test_bad_answers_brake_as_hard_as_the_robot_can(
    situation: Situations, answer: Command | Exception, reason: str
) -> None:
    guarded = Guarded(Answers(answer), LIMITS)
    guarded._last_velocity = (0.5, -0.5)
    command = guarded.command(situation(velocity=(0.5, -0.5)))
    assert command.linear_velocity == pytest.approx(0.4)
    assert command.yaw_rate == pytest.approx(-0.18)
    assert reason in command.reason


@pytest.mark.parametrize("velocity", [(0.5, -0.5), (0.0, 0.0), (7.0, 9.0), (1e300, 1.0)])
def test_a_stop_that_goes_on_ends_standing_whatever_the_odometry_says(
    situation: Situations, velocity: tuple[float, float]
) -> None:
    guarded = Guarded(Answers(Command(0.4, 0.0)), LIMITS)
    blind = replace(situation(velocity=velocity), cloud=None)
    speeds = [guarded.command(blind).linear_velocity for _ in range(7)]
    assert speeds == sorted(speeds, reverse=True)
    assert speeds[-1] == 0.0
    assert guarded.command(situation()).linear_velocity == 0.4
    assert guarded.command(replace(situation(velocity=(0.5, 0.0)), cloud=None)).linear_velocity > 0


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(velocity=st.tuples(st.floats(), st.floats()), answer=st.tuples(st.floats(), st.floats()))
def test_whatever_comes_in_what_goes_out_can_be_driven(
    situation: Situations,
    robot: Robot,
    velocity: tuple[float, float],
    answer: tuple[float, float],
) -> None:
    moment = replace(situation(), velocity=velocity)
    command = Guarded(Answers(Command(*answer)), robot.limits).command(moment)
    assert -1e-6 <= command.linear_velocity <= 0.6 + 1e-6
    assert abs(command.yaw_rate) <= 0.6 + 1e-6
