"""Whatever sensors, odometry and clocks do: a stop with a reason, never a guess."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from planners.fitness import GuardSettings, unfit
from planners.guarded import Guarded
from planners.pose_at import pose_at
from planners.situation import Command, Situation
from tests.planners.conftest import NOW, Situations
from tests.planners.test_guarded import LIMITS, Answers

NAN = float("nan")

Cloud = Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda xyz: xyz[:0], "no return within 1000 m"),
        (lambda xyz: np.full_like(xyz, NAN), "no return within 1000 m"),
        (lambda xyz: np.full_like(xyz, 1e30), "returns are beyond 1000 m"),
        (np.zeros_like, "no return within 1000 m"),
        (lambda xyz: (1000 * xyz).astype(np.int32), "the cloud is int32"),
        (lambda xyz: xyz[:, :2], "expected float32 (N, 3) in metres"),
    ],
)
def test_a_lidar_that_does_not_see(situation: Situations, change: Cloud, reason: str) -> None:
    moment = situation()
    assert moment.cloud is not None
    blind = replace(moment.cloud, xyz=change(moment.cloud.xyz), ring=None)
    assert reason in unfit(replace(moment, cloud=blind), GuardSettings())


@pytest.mark.parametrize("dtype", [np.float32, np.uint16])
def test_a_picture_of_another_kind(situation: Situations, dtype: type) -> None:
    moment = situation()
    assert moment.picture is not None
    other = replace(moment.picture, rgb=moment.picture.rgb.astype(dtype))
    assert "expected uint8 (H, W, 3)" in unfit(replace(moment, picture=other), GuardSettings())


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"goal": (1e308, 0.0)}, "the goal is beyond 1e+08"),
        ({"pose": (-1e308, 0.0, 0.0)}, "the pose is beyond 1e+08"),
        ({"velocity": (1e4, 0.0)}, "the velocity is beyond 100"),
        ({"now_ns": NAN}, "the picture is nan s old"),
    ],
)
def test_numbers_that_are_damage(
    situation: Situations, changes: dict[str, Any], reason: str
) -> None:
    assert reason in unfit(replace(situation(), **changes), GuardSettings())


def test_a_stamp_that_is_no_number(situation: Situations) -> None:
    moment = situation()
    assert moment.cloud is not None
    undated = replace(moment.cloud, stamp_ns=cast("int", NAN))
    assert "the cloud is nan s old" in unfit(replace(moment, cloud=undated), GuardSettings())


def test_odometry_that_goes_back(situation: Situations) -> None:
    moment = situation()
    swapped = (*moment.motions[:-2], moment.motions[-1], moment.motions[-2])
    found = unfit(replace(moment, motions=swapped), GuardSettings())
    assert found == "the odometry's stamps go back by 0.05 s"


def test_a_clock_that_is_set_back_stops_once(situation: Situations) -> None:
    guarded = Guarded(Answers(Command(0.4, 0.0)), LIMITS)
    assert guarded.command(situation()).reason == ""
    back = replace(situation(), now_ns=NOW - 20_000_000)
    assert guarded.command(back).reason == "stop: the clock went back by 0.02 s"
    assert guarded.command(back).reason == ""


@pytest.mark.parametrize(
    ("moment", "reason"),
    [(None, "the situation is None"), ("situation", "the situation is a str")],
)
def test_what_is_no_situation(moment: Any, reason: str) -> None:
    command = Guarded(Answers(Command(0.4, 0.0)), LIMITS).command(moment)
    assert (command.linear_velocity, command.yaw_rate) == (0.0, 0.0)
    assert reason in command.reason


def test_a_velocity_that_is_too_large_for_a_float(situation: Situations) -> None:
    moment = replace(situation(), velocity=(10**400, 0))
    command = Guarded(Answers(Command(0.4, 0.0)), LIMITS).command(moment)
    assert (command.linear_velocity, command.yaw_rate) == (0.0, 0.0)
    assert command.reason.startswith("stop: ")


@pytest.mark.parametrize("place", [(NAN, 0.0, 0.0), (1e30, 0.0, 0.0)])
def test_a_damaged_pose_is_passed_over(
    situation: Situations, place: tuple[float, float, float]
) -> None:
    moment = situation(pose=(0.0, 0.0, 0.0))
    damaged = replace(moment.motions[-2], position=place)
    motions = (*moment.motions[:-2], damaged, moment.motions[-1])
    found = pose_at(replace(moment, motions=motions), _stamp(moment, -2))
    assert found == pytest.approx((-0.015, 0.0, 0.0))


def _stamp(moment: Situation, row: int) -> int:
    stamp = moment.motions[row].stamp_ns
    assert stamp is not None
    return stamp
