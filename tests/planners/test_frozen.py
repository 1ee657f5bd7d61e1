"""Data that stay the same to the bit while the robot drives, under stamps that go on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from graspe_data.robot import Limits
from graspe_data.sensor_data import Picture
from planners.fitness import GuardSettings
from planners.guarded import Guarded
from planners.situation import Command, Situation
from tests.planners.conftest import NOW
from tests.planners.every_planner import SECOND, seen_anew, sound

LIMITS = Limits(linear_velocity=(0.0, 0.6), yaw_rate=(-0.6, 0.6))
GUARD = GuardSettings(answer_s=30.0)
STEP_NS = SECOND // 10
PICTURES = np.random.default_rng(0).integers(0, 255, (100, 48, 64, 3), np.uint8)

Change = Callable[[Situation, int], Situation]


class Drives:
    """A planner that looks at nothing."""

    def __init__(self, speed: float = 0.5) -> None:
        self.speed = speed

    def command(self, situation: Situation) -> Command:  # noqa: ARG002
        return Command(self.speed, 0.0)


def moving(step: int, velocity: tuple[float, float] = (0.5, 0.0)) -> Situation:
    """A robot that drives on, whose sensors see something new each time."""
    moment = seen_anew(sound(NOW + step * STEP_NS), step)
    picture = Picture(moment.now_ns, "camera", PICTURES[step])
    pose = (0.1 * step * velocity[0], 0.0, 0.1 * step * velocity[1])
    return replace(moment, picture=picture, pose=pose, velocity=velocity)


def reasons(
    change: Change, guard: GuardSettings = GUARD, steps: int = 40, speed: float = 0.5
) -> list[str]:
    guarded = Guarded(Drives(speed), LIMITS, guard)
    return [guarded.command(change(moving(step), step)).reason for step in range(steps)]


def same_cloud(moment: Situation, step: int) -> Situation:
    assert moment.cloud is not None
    first = moving(0).cloud
    assert first is not None
    return replace(moment, cloud=replace(moment.cloud, xyz=first.xyz)) if step else moment


def same_picture(moment: Situation, step: int) -> Situation:
    del step
    assert moment.picture is not None
    return replace(moment, picture=replace(moment.picture, rgb=PICTURES[0]))


def same_pose(moment: Situation, step: int) -> Situation:
    del step
    return replace(moment, pose=(0.0, 0.0, 0.0))


FROZEN: dict[str, Change] = {"cloud": same_cloud, "picture": same_picture, "pose": same_pose}


def test_what_goes_on_is_driven_by() -> None:
    assert set(reasons(lambda moment, _: moment)) == {""}


@pytest.mark.parametrize("name", FROZEN)
def test_what_is_frozen_stops_the_robot_within_half_a_metre(name: str) -> None:
    found = reasons(FROZEN[name])
    first = next(step for step, reason in enumerate(found) if reason)
    assert 10 <= first <= 12
    assert f"the {name} has stayed the same to the bit while the robot drove 0.5 m" in found[first]
    assert all(found[first:])


@pytest.mark.parametrize("name", FROZEN)
def test_a_robot_that_turns_on_the_spot_drives_too(name: str) -> None:
    def turning(moment: Situation, step: int) -> Situation:
        return FROZEN[name](replace(moment, velocity=(0.0, 0.5)), step)

    assert any("stayed the same" in reason for reason in reasons(turning))


@pytest.mark.parametrize("name", ["cloud", "picture"])
def test_a_robot_that_stands_may_see_the_same(name: str) -> None:
    def standing(moment: Situation, step: int) -> Situation:
        return FROZEN[name](replace(moment, pose=(0.0, 0.0, 0.0), velocity=(0.0, 0.0)), step)

    assert set(reasons(standing, speed=0.0)) == {""}
    # Told to drive, a robot whose odometry is frozen as well says that it stands.
    assert any(f"the {name} has stayed the same" in reason for reason in reasons(standing))


def test_a_message_that_waits_for_the_next_one_is_not_frozen() -> None:
    def slow(moment: Situation, step: int) -> Situation:
        held = moving(step - step % 4)
        return replace(moment, cloud=held.cloud, picture=held.picture)

    assert set(reasons(slow)) == {""}


def test_a_covered_lens_gives_one_grey_time_and_again() -> None:
    def covered(moment: Situation, step: int) -> Situation:
        del step
        assert moment.picture is not None
        return replace(moment, picture=replace(moment.picture, rgb=np.zeros_like(PICTURES[0])))

    assert set(reasons(covered)) == {""}


def test_pictures_do_not_matter_to_a_planner_by_the_lidar() -> None:
    guard = GUARD.model_copy(update={"needs_picture": False})
    assert set(reasons(same_picture, guard)) == {""}


@pytest.mark.parametrize(("apart", "stamped"), [(1.9, False), (2.1, True), (50.0, True)])
def test_a_pose_from_elsewhere_needs_a_stamp(apart: float, stamped: bool) -> None:
    moment = replace(sound(), pose=(apart, 0.0, 0.0))
    guarded = Guarded(Drives(), LIMITS, GUARD)
    reason = guarded.command(moment).reason
    assert ("give its stamp as `odometry_ns`" in reason) == stamped
    known = replace(moment, odometry_ns=moment.now_ns)
    assert Guarded(Drives(), LIMITS, GUARD).command(known).reason == ""
