"""Nothing that a planner is given is believed alone: what made robots drive at walls."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from graspe_data.observation.intensity_map.strength import IntensityScale
from graspe_data.robot import Limits
from planners.fitness import GuardSettings
from planners.goal import GoalSettings, GoalWatch
from planners.guarded import Guarded
from planners.pose_at import pose_at
from planners.situation import Command, Situation
from tests.planners.conftest import NOW, Robots, motions_until
from tests.planners.every_planner import (
    DRIVEN,
    PLANNERS,
    SECOND,
    guarded,
    seen_anew,
    sound,
    stops,
    with_cloud,
)

LIMITS = Limits(linear_velocity=(0.0, 0.6), yaw_rate=(-0.6, 0.6))
GUARD = GuardSettings(needs_picture=False, answer_s=30.0)
BY_MAP = ("dwa_map", "mim", "glass_slam")
STEP_NS = SECOND // 10


def with_wall(moment: Situation, ahead: float = 0.9) -> Situation:
    """A solid wall across the way, metres ahead of base_link."""
    cloud = moment.cloud
    assert cloud is not None
    assert cloud.intensity is not None
    assert cloud.ring is not None
    y, z = np.meshgrid(np.linspace(-2, 2, 120), np.linspace(-0.4, 0.2, 6))
    wall = np.stack([np.full(y.size, ahead), y.ravel(), z.ravel()], axis=1).astype(np.float32)
    return with_cloud(
        moment,
        xyz=np.concatenate([cloud.xyz, wall]),
        intensity=np.concatenate([cloud.intensity, np.full(len(wall), 200, np.float32)]),
        ring=np.concatenate([cloud.ring, np.full(len(wall), 3, np.int32)]),
    )


class Says:
    """A planner that gives what it is told to give."""

    def __init__(self, answer: Any) -> None:
        self.answer = answer

    def command(self, situation: Situation) -> Command:  # noqa: ARG002
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer  # type: ignore[no-any-return]


@pytest.mark.parametrize("name", BY_MAP)
@pytest.mark.parametrize("pose", [(50.0, 20.0, 1.0), (-1.9, 0.0, 0.0), (0.0, 0.0, 1.5)])
def test_a_map_lies_where_the_cloud_was_whatever_frame_the_pose_is_in(
    name: str, pose: tuple[float, float, float], robots: Robots
) -> None:
    x, y, yaw = pose
    goal = (x + 8 * np.cos(yaw), y + 8 * np.sin(yaw))
    moment = replace(with_wall(sound()), pose=pose, goal=goal, odometry_ns=NOW)
    same = guarded(name, robots).command(with_wall(sound()))
    found = guarded(name, robots).command(moment)
    assert found.linear_velocity == pytest.approx(same.linear_velocity)
    assert found.linear_velocity < 0.6


def test_the_way_since_a_cloud_is_told_by_the_motions_alone() -> None:
    moment = replace(sound(), pose=(50.0, 20.0, np.pi / 2), odometry_ns=NOW)
    x, y, yaw = pose_at(moment, moment.now_ns - SECOND)
    assert (x, y, yaw) == pytest.approx((50.0, 20.0 - DRIVEN[0], np.pi / 2), abs=0.02)


@pytest.mark.parametrize("name", ["dwa_fox", "dwa_lab"])
def test_a_planner_does_not_drive_where_it_does_not_see(name: str, robots: Robots) -> None:
    both_ways = robots.robot.limits.model_copy(update={"linear_velocity": (-1.6, 1.6)})
    robot = robots.robot.model_copy(update={"limits": both_ways})
    planner = guarded(name, replace(robots, robot=robot))
    if name == "dwa_lab":
        planner._planner._obstacles = type(  # type: ignore[attr-defined]
            "Ahead", (), {"sees_behind": False, "points": lambda *_: np.array([[0.8, 0.0]])}
        )()
    moment = replace(with_wall(sound(), 0.75), velocity=(0.0, 0.0), motions=_standing(NOW))
    for step in range(5):
        command = planner.command(_later(moment, step))
        assert command.linear_velocity >= 0.0


def _standing(now_ns: int) -> Any:
    return motions_until(now_ns, (0.0, 0.0))


def _later(moment: Situation, step: int) -> Situation:
    now_ns = NOW + step * STEP_NS
    assert moment.cloud is not None
    moment = replace(moment, now_ns=now_ns, motions=_standing(now_ns))
    moment = seen_anew(moment, step)
    assert moment.picture is not None
    return replace(
        with_cloud(moment, stamp_ns=now_ns - 80_000_000),
        picture=replace(moment.picture, stamp_ns=now_ns - 50_000_000),
    )


def test_dwa_lab_turns_only_where_it_has_room(robots: Robots) -> None:
    planner = guarded("dwa_lab", robots)
    box = np.array([[x, s * 0.47] for x in np.arange(-0.6, 0.6, 0.05) for s in (1, -1)])
    planner._planner._obstacles = type(  # type: ignore[attr-defined]
        "Box", (), {"sees_behind": True, "points": lambda *_: np.vstack([box, [[0.6, 0.0]]])}
    )()
    moment = replace(sound(), velocity=(0.0, 0.0), motions=_standing(NOW))
    command = planner.command(moment)
    assert (command.linear_velocity, command.yaw_rate) == (0.0, 0.0)
    assert "no room to turn" in command.reason


@pytest.mark.parametrize("name", [name for name in PLANNERS if name != "graspe"])
@pytest.mark.parametrize(
    "mounting",
    [
        Transform(np.eye(3), np.full(3, np.nan)),
        Transform(np.zeros((3, 3)), np.zeros(3)),
        Transform(10 * np.eye(3), np.zeros(3)),
        Transform(np.diag([1.0, 1.0, -1.0]), np.zeros(3)),
        Transform(np.eye(3), np.array([0.0, 0.0, 50.0])),
    ],
)
def test_a_mounting_that_is_none_is_refused(name: str, mounting: Transform, robots: Robots) -> None:
    calibration = replace(robots.calibration, base_from_lidar=mounting)
    with pytest.raises(PlannerError, match="the lidar's mounting is"):
        guarded(name, replace(robots, calibration=calibration))


def test_two_frozen_clouds_in_turn_are_frozen() -> None:
    guard = Guarded(Says(Command(0.5, 0.0)), LIMITS, GUARD)
    reasons = [guard.command(_driving(step, step % 2)).reason for step in range(30)]
    assert "the cloud has stayed the same" in reasons[-1]


def test_a_frozen_cloud_is_told_by_the_poses_where_the_velocity_says_nothing() -> None:
    guard = Guarded(Says(Command(0.0, 0.0)), LIMITS, GUARD)
    moment = [replace(_driving(step, 0), velocity=(0.0, 0.0)) for step in range(30)]
    assert "the cloud has stayed the same" in [guard.command(each).reason for each in moment][-1]


def _driving(step: int, content: int) -> Situation:
    now_ns = NOW + step * STEP_NS
    x = 0.05 * step
    moved = tuple(
        replace(m, position=(x + (m.position or (0,))[0], 0.0, 0.0))
        for m in motions_until(now_ns, (0.5, 0.0))
    )
    moment = replace(sound(now_ns), pose=(x, 0.0, 0.0), velocity=(0.5, 0.0), motions=moved)
    return seen_anew(moment, content)


def test_a_situation_that_is_not_renewed_stops_the_robot() -> None:
    seconds = iter([0.0, 0.0, 0.1, 0.2, 0.29, 0.31, 0.5, 0.6, 0.61, 0.7, 0.8])
    latest = [0.0]

    def clock() -> float:
        latest[0] = next(seconds, latest[0])
        return latest[0]

    guard = Guarded(Says(Command(0.4, 0.0)), LIMITS, GUARD, clock)
    reasons = [guard.command(sound()).reason for _ in range(6)]
    assert reasons[0] == ""
    assert "the clock has stood still" in reasons[-1]
    assert guard.command(seen_anew(sound(NOW + STEP_NS), 1)).reason == ""


@pytest.mark.parametrize("what", ["cloud", "picture"])
def test_stamps_of_a_sensor_that_go_back_stop_the_robot(what: str) -> None:
    settings = GUARD.model_copy(update={"needs_picture": what == "picture"})
    guard = Guarded(Says(Command(0.4, 0.0)), LIMITS, settings)
    assert guard.command(sound()).reason == ""
    later = seen_anew(sound(NOW + STEP_NS), 1)
    held = getattr(later, what)
    back = replace(later, **{what: replace(held, stamp_ns=held.stamp_ns - 3 * STEP_NS)})
    assert f"the {what}'s stamp went back by 0.20 s" in guard.command(back).reason


@pytest.mark.parametrize(
    ("age_s", "reason"), [(0.45, "the robot has driven 0.50 m since"), (0.3, "")]
)
def test_at_speed_a_cloud_ages_sooner(age_s: float, reason: str) -> None:
    fast = Limits(linear_velocity=(0.0, 1.2), yaw_rate=(-0.6, 0.6))
    guard = Guarded(Says(Command(1.1, 0.0)), fast, GUARD)
    moment = with_cloud(sound(), stamp_ns=NOW - round(age_s * SECOND))
    moment = replace(moment, velocity=(1.1, 0.0), motions=motions_until(NOW, (1.1, 0.0)))
    assert reason in guard.command(moment).reason


def test_a_stop_never_sets_a_standing_robot_in_motion() -> None:
    guard = Guarded(Says(Command(0.0, 0.0)), LIMITS, GUARD)
    old = replace(sound(), velocity=(0.6, 0.6), motions=motions_until(NOW - SECOND, (0.6, 0.6)))
    for step in range(6):
        moment = seen_anew(sound(NOW + step * STEP_NS), step) if step % 2 else old
        command = guard.command(replace(moment, now_ns=NOW + step * STEP_NS))
        assert (command.linear_velocity, command.yaw_rate) == (0.0, 0.0)


class Mute(Exception):  # noqa: N818 - it is no error of ours
    def __str__(self) -> str:
        raise RuntimeError


class Broken:
    def __iter__(self) -> Iterator[float]:
        raise RuntimeError("gone")


class Full(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:  # noqa: ARG002
        raise OSError("disk full")


@pytest.mark.parametrize(
    "moment",
    [
        replace(sound(), cloud=None),
        replace(sound(), velocity=cast("Any", Broken())),
        None,
        object(),
        {},
    ],
)
@pytest.mark.parametrize("answer", [Mute(), Command(0.4, 0.0)])
def test_nothing_makes_it_raise(moment: Any, answer: Any) -> None:
    log, handler = logging.getLogger("planners"), Full()
    log.addHandler(handler)
    try:
        guard = Guarded(Says(answer), LIMITS, GUARD)
        for each in (sound(), moment, seen_anew(sound(NOW + STEP_NS), 1)):
            assert isinstance(guard.command(each), Command)
        assert stops(guard.command(moment))
    finally:
        log.removeHandler(handler)


def test_a_thread_that_does_not_start_stops_the_robot_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    guard = Guarded(Says(Command(0.4, 0.0)), LIMITS, GUARD)

    def failing(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", failing)
        patched.setattr("planners.deadline._idle", [])
        assert "can't start new thread" in guard.command(sound()).reason
    assert guard.command(seen_anew(sound(NOW + STEP_NS), 1)).reason == ""


def test_a_goal_that_jitters_is_given_up_all_the_same() -> None:
    watch = GoalWatch(GoalSettings(progress_s=10.0))
    random, verdicts = np.random.default_rng(0), []
    for step in range(200):
        goal = (8.0 + random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3))
        verdicts.append(watch.standing(replace(sound(NOW + step * STEP_NS), goal=goal)))
    assert verdicts[-1] is not None
    assert "no progress" in verdicts[-1].reason


@pytest.mark.parametrize("returns", [10_000, 28_800])
def test_strays_do_not_decide_the_scale_of_intensities(returns: int) -> None:
    scale = IntensityScale(255.0)
    random = np.random.default_rng(0)
    decided = []
    for cloud in range(8):
        values = random.integers(0, 101, returns).astype(np.float32)
        values[0] = 110 + 10 * cloud
        try:
            scale.strength(values)
        except Exception:  # noqa: BLE001 - undecided
            decided.append(False)
        else:
            decided.append(True)
    assert not any(decided)


@pytest.mark.parametrize("name", PLANNERS)
def test_another_cloud_under_the_same_stamp_is_seen(name: str, robots: Robots) -> None:
    planner = guarded(name, robots)
    assert planner.command(sound()).linear_velocity > DRIVEN[0]
    if name != "graspe":
        blocked = with_wall(replace(sound(), now_ns=NOW + 2 * STEP_NS), 0.75)
        again = replace(blocked, motions=motions_until(NOW + 2 * STEP_NS, DRIVEN))
        assert planner.command(again).linear_velocity <= DRIVEN[0]


@pytest.mark.parametrize("name", PLANNERS)
def test_odometry_that_reorders_a_little_is_sorted(name: str, robots: Robots) -> None:
    moment = sound()
    late = (*moment.motions[:-2], moment.motions[-1], moment.motions[-2])
    found = guarded(name, robots).command(replace(moment, motions=late))
    same = guarded(name, robots).command(moment)
    assert (found.linear_velocity, found.yaw_rate) == (same.linear_velocity, same.yaw_rate)
    assert found.reason == ""
