"""Every fault at run time on every planner: what it does, within how long, and the docs' table."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from graspe_data.sensor_data import Motion
from planners.situation import Command, Situation
from tests.planners.conftest import NOW, Robots, motions_until
from tests.planners.every_planner import (
    BY_INTENSITY,
    BY_MODEL,
    DRIVEN,
    PLANNERS,
    SECOND,
    guarded,
    sound,
    stops,
    with_cloud,
    with_picture,
)

DOCS = Path(__file__).resolve().parents[2] / "docs" / "planners.md"
BEGIN, END = "<!-- generated: faults -->\n", "<!-- end -->\n"
ALL = tuple(PLANNERS)
AT_ONCE = "the same command"
NAN = float("nan")

Change = Callable[[Situation], Situation]


class Fault(NamedTuple):
    """What is wrong with a situation, and a piece of the reason that planners give for it."""

    change: Change
    reason: str
    planners: tuple[str, ...] = ALL
    within: str = AT_ONCE
    lasts: bool = True


def strengths(change: Callable[[np.ndarray], Any]) -> Change:
    """Another intensity of the same returns."""

    def changed(moment: Situation) -> Situation:
        assert moment.cloud is not None
        assert moment.cloud.intensity is not None
        return with_cloud(moment, intensity=change(moment.cloud.intensity.copy()))

    return changed


def returns(change: Callable[[np.ndarray], Any]) -> Change:
    """Other points with all else as it was."""

    def changed(moment: Situation) -> Situation:
        assert moment.cloud is not None
        return with_cloud(moment, xyz=change(moment.cloud.xyz.copy()))

    return changed


def saturated(strength: np.ndarray) -> np.ndarray:
    one = strength / 255
    one[7] = 255
    return np.asarray(one, np.float32)


def late(name: str, seconds: float) -> Change:
    """A picture or a cloud of so long before now."""

    def changed(moment: Situation) -> Situation:
        stamp_ns = moment.now_ns - round(seconds * SECOND)
        change = with_picture if name == "picture" else with_cloud
        return change(moment, stamp_ns=stamp_ns)

    return changed


def odometry(seconds: float) -> Change:
    """Odometry that ended so long before now."""
    return lambda moment: replace(
        moment, motions=motions_until(moment.now_ns - round(seconds * SECOND), DRIVEN)
    )


def one(**changes: Any) -> Change:
    return lambda moment: replace(moment, **changes)


def swapped(moment: Situation) -> Situation:
    """The latest motion comes a quarter of a second early."""
    return replace(
        moment, motions=(*moment.motions[:-6], moment.motions[-1], *moment.motions[-6:-1])
    )


def leaping(moment: Situation) -> Situation:
    """Odometry in which the robot was elsewhere half a second ago."""
    moved = [
        replace(m, position=(20.0, 0.0, 0.0)) if m.stamp_ns < moment.now_ns - SECOND // 2 else m
        for m in moment.motions
        if m.stamp_ns is not None
    ]
    return replace(moment, motions=tuple(moved))


def motions_standing() -> tuple[Motion, ...]:
    """Odometry that says 0.6 m/s, and always the same pose."""
    until = NOW + SECOND // 10
    return tuple(replace(m, position=(0.0, 0.0, 0.0)) for m in motions_until(until, (0.6, 0.0)))


def some(which: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Only some of the returns."""

    def changed(moment: Situation) -> Situation:
        cloud = moment.cloud
        assert cloud is not None
        assert cloud.intensity is not None
        assert cloud.ring is not None
        kept = which(cloud.xyz)
        return with_cloud(
            moment, xyz=cloud.xyz[kept], intensity=cloud.intensity[kept], ring=cloud.ring[kept]
        )

    return changed


def in_frame(frame: str) -> Change:
    return lambda moment: with_cloud(moment, frame=frame)


def seen_in(frame: str) -> Change:
    return lambda moment: with_picture(moment, frame=frame)


def grey(shape: tuple[int, ...], dtype: type = np.uint8) -> Change:
    return lambda moment: with_picture(moment, rgb=np.full(shape, 200, dtype))


BAD_FRAME = "is in the frame"
FAULTS = {
    "no picture": Fault(one(picture=None), "there is no picture", BY_MODEL),
    "the camera is dead": Fault(
        late("picture", 0.51), "s old, more than 0.5 s", BY_MODEL, "0.5 s (`picture_age_s`)"
    ),
    "a picture from the future": Fault(late("picture", -0.1), "in the future", BY_MODEL),
    "a picture in grey": Fault(grey((48, 64)), "expected uint8 (H, W, 3)", BY_MODEL),
    "a picture in floats": Fault(grey((48, 64, 3), np.float32), "expected uint8", BY_MODEL),
    "a picture that is no array": Fault(
        lambda moment: with_picture(moment, rgb=[[0]]), "the picture is a list", BY_MODEL
    ),
    "a picture of another size": Fault(grey((96, 64, 3)), "64x96", BY_MODEL),
    "a picture in the base's frame": Fault(seen_in("base_link"), BAD_FRAME, BY_MODEL),
    "a picture in the odometry's frame": Fault(seen_in("odom"), BAD_FRAME, BY_MODEL),
    "no cloud": Fault(one(cloud=None), "there is no cloud"),
    "the lidar is dead": Fault(
        late("cloud", 0.51), "s old, more than 0.5 s", within="0.5 s (`cloud_age_s`)"
    ),
    "a cloud from the future": Fault(late("cloud", -0.1), "in the future"),
    "a cloud in the odometry's frame": Fault(in_frame("odom"), BAD_FRAME),
    "a cloud in a map's frame": Fault(in_frame("/map"), BAD_FRAME),
    "a cloud in the base's frame": Fault(in_frame("base_link"), BAD_FRAME),
    "a cloud in a frame like odom_ned or base_link_frd": Fault(in_frame("odom_ned"), BAD_FRAME),
    "a cloud in a camera's frame": Fault(in_frame("camera_optical"), BAD_FRAME),
    "a cloud that names no frame": Fault(in_frame(""), BAD_FRAME),
    "a cloud that is no array": Fault(
        lambda moment: with_cloud(moment, xyz=[[1.0, 0.0, 0.0]]), "the cloud is a list"
    ),
    "a cloud without a stamp": Fault(
        lambda moment: with_cloud(moment, stamp_ns=None), "the cloud has the stamp None"
    ),
    "a cloud of no returns": Fault(returns(np.zeros_like), "the cloud has no return within 1000 m"),
    "a cloud of one return": Fault(
        some(lambda xyz: np.arange(len(xyz)) < 1), "the lidar is covered"
    ),
    "a lidar that is covered ahead": Fault(
        some(lambda xyz: xyz[:, 0] < 1.0), "the lidar is covered there"
    ),
    "a lidar that sees its own cover": Fault(
        returns(lambda xyz: 0.1 * xyz / np.linalg.norm(xyz, axis=1, keepdims=True)),
        "the lidar is covered, or sees nothing",
    ),
    "a cloud in millimetres, as whole numbers": Fault(
        returns(lambda xyz: (1000 * xyz).astype(np.int32)), "expected float32 (N, 3) in metres"
    ),
    "a cloud in millimetres, as floats": Fault(
        returns(lambda xyz: 1000 * xyz), "returns are beyond 1000 m"
    ),
    "a cloud without heights": Fault(
        returns(lambda xyz: xyz[:, :2]), "expected float32 (N, 3) in metres"
    ),
    "fewer ring numbers than returns": Fault(
        lambda moment: with_cloud(moment, ring=np.zeros(3, np.int32)),
        "the cloud's ring is int32 (3,)",
    ),
    "ring numbers with fractions": Fault(
        lambda moment: with_cloud(moment, ring=np.zeros(450)), "the cloud's ring is float64"
    ),
    "fewer intensities than returns": Fault(
        strengths(lambda strength: strength[:-1]), "the cloud's intensity is float32 (449,)"
    ),
    "a lidar of 32 rings, declared as 16": Fault(
        lambda moment: with_cloud(moment, ring=np.arange(450, dtype=np.int32) % 32),
        "`lidar.rings` of the robot manifest is 16",
    ),
    "no intensity": Fault(strengths(lambda _: None), "has no intensity", BY_INTENSITY),
    "intensities of 0": Fault(strengths(np.zeros_like), "intensities are 0", BY_INTENSITY),
    "intensities that are no numbers": Fault(
        strengths(lambda strength: strength * NAN), "intensities are NaN", BY_INTENSITY
    ),
    "intensity on 0..1, declared as 0..255": Fault(
        strengths(lambda strength: strength / 255), "scale", BY_INTENSITY
    ),
    "the same with one saturated return": Fault(strengths(saturated), "scale", BY_INTENSITY),
    "intensity on 0..100, declared as 0..255": Fault(
        strengths(lambda strength: strength * np.float32(100 / 255)), "scale", BY_INTENSITY
    ),
    "intensity on 0..65535, declared as 0..255": Fault(
        strengths(lambda strength: strength * 257), "are above 255", BY_INTENSITY
    ),
    "no odometry": Fault(one(motions=()), "there is no odometry"),
    "odometry is dead": Fault(
        odometry(0.31), "s old, more than 0.3 s", within="0.3 s (`odometry_age_s`)"
    ),
    "odometry of an hour ago": Fault(odometry(3600), "the odometry is 3600.00 s old"),
    "pose and velocity with an old stamp": Fault(
        one(odometry_ns=NOW - SECOND), "the odometry is 1.10 s old"
    ),
    "odometry whose stamps go back": Fault(swapped, "the odometry's stamps go back"),
    "odometry that leaps": Fault(leaping, "the odometry leaps by 20.15 m"),
    "velocities that are none of the poses": Fault(
        one(motions=motions_standing()), "the poses 0.00 m: one of them is wrong"
    ),
    "a velocity beyond twice the robot's limits": Fault(
        one(velocity=(60.0, 0.0)), "60 m/s, 0 rad/s is beyond twice the robot's limits"
    ),
    "an odometry of a million motions": Fault(
        lambda moment: replace(moment, motions=tuple(moment.motions) * 300), "at most 20000"
    ),
    "odometry of something else": Fault(one(motions=("moved",)), "the odometry has a str in it"),
    "a pose that is no number": Fault(one(pose=(NAN, 0.0, 0.0)), "the pose is not finite"),
    "a pose without yaw": Fault(one(pose=(0.0, 0.0)), "the pose has the shape (2,)"),
    "a velocity of six numbers": Fault(one(velocity=(0.3,) * 6), "the velocity has the shape"),
    "a velocity beyond anything": Fault(one(velocity=(1e4, 0.0)), "the velocity is beyond 100"),
    "no goal": Fault(one(goal=None), "the goal is not finite"),
    "a goal of three numbers": Fault(one(goal=(8.0, 0.0, 0.0)), "the goal has the shape (3,)"),
    "the robot's clock set back": Fault(
        lambda moment: sound(moment.now_ns - SECOND), "the clock went back", lasts=False
    ),
}
"""By what is wrong."""


def each() -> Iterator[Any]:
    for name, fault in FAULTS.items():
        for planner in fault.planners:
            yield pytest.param(planner, fault, id=f"{planner}, {name}")


@pytest.mark.parametrize("name", ALL)
def test_a_sound_situation_is_driven(name: str, robots: Robots) -> None:
    planner = guarded(name, robots)
    for step in range(3):
        command = planner.command(sound(NOW + step * SECOND // 10))
        assert command.linear_velocity > DRIVEN[0]
        assert (command.reason, command.arrived) == ("", False)


@pytest.mark.parametrize(("name", "fault"), each())
def test_a_fault_stops_the_robot_and_says_why(name: str, fault: Fault, robots: Robots) -> None:
    fresh, driving = guarded(name, robots), guarded(name, robots)
    assert driving.command(sound()).reason == ""
    moment = fault.change(sound(NOW + SECOND // 10))
    for planner in (driving,) if "clock went back" in fault.reason else (fresh, driving):
        command = planner.command(moment)
        assert stops(command)
        assert fault.reason in command.reason
        more = [planner.command(moment) for _ in range(3 if fault.lasts else 0)]
        assert all(each.linear_velocity == 0.0 for each in more[2:])
    later = sound(NOW + SECOND)
    assert driving.command(later).reason == ""


@pytest.mark.parametrize(
    ("name", "change"),
    [
        *((name, odometry(0.29)) for name in ALL if name not in BY_MODEL),
        *((name, late("cloud", 0.49)) for name in ALL),
        *((name, late("picture", 0.49)) for name in BY_MODEL),
    ],
)
def test_what_is_just_young_enough_is_driven_by(name: str, change: Change, robots: Robots) -> None:
    assert guarded(name, robots).command(change(sound())).reason == ""


@pytest.mark.parametrize("name", [name for name in ALL if name not in BY_MODEL])
def test_planners_that_need_no_picture_do_not_look_at_one(name: str, robots: Robots) -> None:
    assert guarded(name, robots).command(replace(sound(), picture=None)).reason == ""


@pytest.mark.parametrize("name", ALL)
def test_returns_at_the_origin_and_damage_are_passed_over(name: str, robots: Robots) -> None:
    moment = sound()
    assert moment.cloud is not None
    assert moment.cloud.intensity is not None
    assert moment.cloud.ring is not None
    rows = np.array([[0, 0, 0], [NAN, 0, 0], [3e38, 0, 0]] * 20, np.float32)
    damaged = with_cloud(
        moment,
        xyz=np.concatenate([rows, moment.cloud.xyz]),
        intensity=np.concatenate([np.full(60, 230, np.float32), moment.cloud.intensity]),
        ring=np.concatenate([np.ones(60, np.int32), moment.cloud.ring]),
    )
    whole = robots.robot.model_copy(
        update={"lidar": robots.robot.lidar.model_copy(update={"minimum_range": 0.0})}
    )
    free = robots if name in BY_MODEL else replace(robots, robot=whole)
    found, expected = (guarded(name, free).command(each) for each in (damaged, moment))
    assert _driven(found) == _driven(expected)


def _driven(command: Command) -> tuple[float, float, str]:
    return command.linear_velocity, command.yaw_rate, command.reason


class Hangs:
    """A planner that takes its time."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self.asked = seconds, 0

    def command(self, situation: Situation) -> Command:
        del situation
        self.asked += 1
        time.sleep(self.seconds)
        return Command(0.6, 0.0)


LIMIT_S = 0.2
RUNNING: dict[str, tuple[str, str, str]] = {
    "the planner takes too long": ("no answer within", "all", "0.5 s (`answer_s`)"),
    "it still does": ("no answer yet to the question of", "all", AT_ONCE),
    "the planner raises": ("its words", "all", AT_ONCE),
    "a command beyond the robot's limits, or no number": ("is not within", "all", AT_ONCE),
    "the bundle was loaded in another process": ("call load_bundle in", "graspe", AT_ONCE),
    "the same picture under new stamps, as the robot drives": (
        "the picture has stayed the same to the bit",
        "graspe",
        "0.5 m (`frozen_m`)",
    ),
    "the situation is not renewed": (
        "the clock has stood still",
        "all",
        "0.3 s (`odometry_age_s`)",
    ),
    "a cloud of so long ago that the robot has driven 0.4 m since": (
        "the robot has driven",
        "all",
        "0.4 m (`stale_m`)",
    ),
    "a cloud's stamp that goes back": ("the cloud's stamp went back", "all", AT_ONCE),
    "the same cloud or pose": ("has stayed the same to the bit", "all", "0.5 m (`frozen_m`)"),
    "a pose from elsewhere without a stamp": ("give its stamp as `odometry_ns`", "all", AT_ONCE),
    "the goal is reached": ("arrived", "all", AT_ONCE + " (`goal.radius`, 0.5 m)"),
    "the goal gets no nearer": ("no progress", "all", "60 s (`goal.progress_s`)"),
}
"""What the other tests of planners show."""


def test_a_planner_that_hangs_is_not_waited_for(robots: Robots) -> None:
    planner = Hangs(1.0)
    watched = guarded("dwa_fox", robots, answer_s=LIMIT_S)
    watched._planner = planner
    begun = time.monotonic()
    commands = [watched.command(sound(NOW + step)) for step in range(3)]
    assert time.monotonic() - begun < LIMIT_S + 0.5
    assert all(stops(command) for command in commands)
    assert "no answer within 0.2 s" in commands[0].reason
    assert "no answer yet to the question of" in commands[2].reason
    time.sleep(1.2)
    planner.seconds = 0.0
    assert watched.command(sound(NOW + SECOND)).reason == ""
    assert planner.asked == 2


def test_the_docs_table_is_that_of_these_tests() -> None:
    lines = ["| what is wrong | whom it stops | because | within |", "| --- | --- | --- | --- |"]
    for name, fault in FAULTS.items():
        who = "all" if fault.planners == ALL else ", ".join(f"`{each}`" for each in fault.planners)
        lines.append(f"| {name} | {who} | {fault.reason} | {fault.within} |")
    for name, (reason, who, within) in RUNNING.items():
        lines.append(f"| {name} | {who if who == 'all' else f'`{who}`'} | {reason} | {within} |")
    text = DOCS.read_text(encoding="utf-8")
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    expected = head + BEGIN + "\n".join(lines) + "\n" + END + tail
    if os.environ.get("GRASPE_WRITE_DOCS"):
        DOCS.write_text(expected, encoding="utf-8")
    assert text == expected, "write it anew: GRASPE_WRITE_DOCS=1 pytest " + __file__
