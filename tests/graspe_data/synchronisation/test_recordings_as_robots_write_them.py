"""Recordings with the faults of real drivers: right velocities and mountings, or a refusal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from graspe_data.errors import RecordingError
from graspe_data.geometry import Transform, quaternion_from_rotation, rotation_from_rpy
from graspe_data.recordings.writing import Container
from graspe_data.robot import Limits
from tests.graspe_data.synchronisation.made_recording import (
    BACKWARDS,
    CIRCLE,
    CURVES,
    EIGHT,
    MOUNTINGS,
    NO_TURN,
    OPTICAL,
    ROBOT,
    SECOND,
    SPIN,
    STANDING,
    START,
    STRAIGHT,
    Drive,
    Floats,
    Make,
    Motion,
    add_edge,
    add_odometry,
    add_sensors,
    drive,
    kinds,
    robot,
    synchronised,
    times,
    worst,
)

DRIVES = {
    "straight": STRAIGHT,
    "curves": CURVES,
    "circle": CIRCLE,
    "eight": EIGHT,
    "spin": SPIN,
    "backwards": BACKWARDS,
}
BY_TF = robot(odometry="/tf")
ROWS = 71
SMOOTHED = 0.01
"""Central differences at the ends of a drive: half a tenth of a second of acceleration."""


def with_twist(way: Drive, change: Callable[[Floats], Floats]) -> Make:
    """A recording whose poses are right and whose twist is something else."""
    make, motion = Make(), way.at(times(way.seconds, 50))
    add_sensors(make, way.seconds)
    add_odometry(make, motion, change(motion.twist()))
    return make


def with_poses(way: Drive, change: Callable[[Motion], Motion], *, twist: bool) -> Make:
    """A recording whose poses are changed; its twist is right, or empty."""
    make, motion = Make(), way.at(times(way.seconds, 50))
    add_sensors(make, way.seconds)
    given_twist = motion.twist() if twist else 0 * motion.twist()
    add_odometry(make, change(motion), given_twist)
    return make


def scaled(*columns: int, by: float) -> Callable[[Floats], Floats]:
    """Multiply columns of a twist (N, 6)."""

    def change(twist: Floats) -> Floats:
        twist = twist.copy()
        twist[:, list(columns)] *= by
        return twist

    return change


class TestTwistInTheOdometryFrame:
    @pytest.mark.parametrize("heading", [0.0, np.pi / 2, np.pi, -np.pi / 2, 0.8])
    @pytest.mark.parametrize("name", DRIVES)
    @pytest.mark.parametrize("frame", ["body", "fixed"])
    def test_is_the_body_s_whatever_the_drive(
        self, tmp_path: Path, name: str, heading: float, frame: str
    ) -> None:
        way = replace(DRIVES[name], heading=heading)
        found = synchronised(drive(way, twist=frame)[0].write(tmp_path / "r"))
        assert worst(found, way) < 1e-6
        assert found.plan.rows == ROWS

    def test_is_told_apart_and_told(self, tmp_path: Path) -> None:
        way = replace(STRAIGHT, heading=np.pi / 2)
        fixed = synchronised(drive(way, twist="fixed")[0].write(tmp_path / "fixed"))
        assert kinds(fixed) == ["twist_in_fixed_frame"]
        numbers = fixed.findings[0].numbers
        assert numbers["poses_m"] == pytest.approx(5.4, abs=0.1)
        assert numbers["fixed_error_m"] < 1e-3
        assert numbers["body_error_m"] == pytest.approx(5.4 * np.sqrt(2), abs=0.1)
        assert kinds(synchronised(drive(way)[0].write(tmp_path / "body"))) == ["motion_agrees"]

    @pytest.mark.parametrize("rate", [5.0, 10.0, 20.0, 100.0, 200.0])
    @pytest.mark.parametrize("frame", ["body", "fixed"])
    def test_at_any_rate(self, tmp_path: Path, rate: float, frame: str) -> None:
        found = synchronised(drive(EIGHT, rate, frame)[0].write(tmp_path / "r"))
        assert worst(found, EIGHT) < 1e-6

    @pytest.mark.parametrize("slope", [0.3, -0.3, 0.6])
    @pytest.mark.parametrize("frame", ["body", "fixed"])
    def test_on_a_slope(self, tmp_path: Path, slope: float, frame: str) -> None:
        way = replace(EIGHT, slope=slope)
        found = synchronised(drive(way, twist=frame)[0].write(tmp_path / "r"))
        assert worst(found, way) < 1e-6

    @pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
    def test_in_any_container(self, tmp_path: Path, container: Container) -> None:
        found = synchronised(drive(CURVES, twist="fixed")[0].write(tmp_path / "r", container))
        assert worst(found, CURVES) < 1e-6

    @settings(
        max_examples=20,
        deadline=None,
        suppress_health_check=[HealthCheck.function_scoped_fixture],
    )
    @given(
        speed=st.floats(0.1, 1.2),
        swing=st.floats(0, 0.5),
        turn=st.floats(-0.8, 0.8),
        heading=st.floats(-np.pi, np.pi),
        slope=st.floats(-0.4, 0.4),
        frame=st.sampled_from(["body", "fixed"]),
        backwards=st.booleans(),
    )
    def test_of_any_drive(
        self,
        tmp_path_factory: pytest.TempPathFactory,
        speed: float,
        swing: float,
        turn: float,
        heading: float,
        slope: float,
        frame: str,
        backwards: bool,
    ) -> None:
        sign = -1.0 if backwards else 1.0
        way = Drive(
            lambda t: sign * (speed + swing * np.sin(t)),
            lambda t: turn * np.cos(0.6 * t),
            heading=heading,
            slope=slope,
        )
        path = tmp_path_factory.mktemp("any") / "r"
        told_m = synchronised(drive(way, twist=frame)[0].write(path))
        if "twist_in_fixed_frame" in kinds(told_m) or frame == "body":
            assert worst(told_m, way) < 1e-3
        else:  # so nearly along x that the frames cannot be told apart
            assert worst(told_m, way) < 0.1


class TestTwistOrPosesNeverFilled:
    @pytest.mark.parametrize("name", DRIVES)
    def test_velocities_are_taken_from_the_poses(self, tmp_path: Path, name: str) -> None:
        make = with_twist(DRIVES[name], lambda twist: 0 * twist)
        found = synchronised(make.write(tmp_path / "r"))
        filled = "yaw_rate_never_filled" if name == "spin" else "twist_never_filled"
        assert kinds(found) == [filled]
        assert worst(found, DRIVES[name]) < (0.03 if name == "eight" else SMOOTHED)

    @pytest.mark.parametrize("slope", [0.3, -0.6])
    def test_on_a_slope_as_well(self, tmp_path: Path, slope: float) -> None:
        way = replace(CURVES, slope=slope)
        found = synchronised(with_twist(way, lambda twist: 0 * twist).write(tmp_path / "r"))
        assert worst(found, way) < SMOOTHED

    def test_so_are_they_where_it_is_not_a_number(self, tmp_path: Path) -> None:
        found = synchronised(with_twist(CURVES, lambda t: np.nan * t).write(tmp_path / "r"))
        assert kinds(found) == ["no_twist"]
        assert worst(found, CURVES) < SMOOTHED

    def test_a_yaw_rate_alone_may_be_empty(self, tmp_path: Path) -> None:
        found = synchronised(with_twist(CURVES, scaled(5, by=0.0)).write(tmp_path / "r"))
        assert kinds(found) == ["yaw_rate_never_filled"]
        assert worst(found, CURVES) < SMOOTHED

    def test_a_slow_turn_is_not_overlooked(self, tmp_path: Path) -> None:
        slowly = Drive(lambda t: 0.5 + 0 * t, lambda t: 0.08 + 0 * t, seconds=12)
        found = synchronised(with_twist(slowly, scaled(5, by=0.0)).write(tmp_path / "r"))
        assert worst(found, slowly) < 1e-3

    def test_a_robot_that_creeps_is_not_taken_to_stand(self, tmp_path: Path) -> None:
        creeping = Drive(lambda t: 0.045 + 0 * t, lambda t: 0 * t, seconds=20)
        found = synchronised(with_twist(creeping, lambda t: 0 * t).write(tmp_path / "r"))
        assert kinds(found) == ["twist_never_filled"]
        assert worst(found, creeping) < 1e-3

    def test_a_twist_that_stops_while_the_poses_go_on(self, tmp_path: Path) -> None:
        def stopping(twist: Floats) -> Floats:
            twist = twist.copy()
            twist[300:400] = 0
            return twist

        found = synchronised(with_twist(CURVES, stopping).write(tmp_path / "r"))
        assert kinds(found) == ["motion_agrees", "twist_stops"]
        assert worst(found, CURVES) < SMOOTHED

    @pytest.mark.parametrize("name", DRIVES)
    @pytest.mark.parametrize("filled", [True, False])
    def test_poses_are_integrated_from_the_twist(
        self, tmp_path: Path, name: str, filled: bool
    ) -> None:
        way = DRIVES[name]
        make, motion = Make(), way.at(times(way.seconds, 50))
        add_sensors(make, way.seconds)
        same = np.repeat(np.eye(3)[None], motion.seconds.size, axis=0)
        still = replace(motion, position=0 * motion.position, rotation=same)
        add_odometry(make, still, motion.twist(), filled=filled)
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found) == ["poses_never_filled"]
        assert worst(found, way) < 1e-6
        np.testing.assert_allclose(found.odometry.pose[:, :3], motion.position, atol=2e-3)

    def test_a_heading_alone_may_be_empty_where_the_twist_turns(self, tmp_path: Path) -> None:
        make = with_poses(CIRCLE, without_heading, twist=True)
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found) == ["poses_never_filled"]
        assert worst(found, CIRCLE) < 1e-6

    @pytest.mark.parametrize("name", ["curves", "circle", "backwards"])
    def test_a_heading_and_a_twist_that_are_both_empty_are_refused(
        self, tmp_path: Path, name: str
    ) -> None:
        make = with_poses(DRIVES[name], without_heading, twist=False)
        with pytest.raises(RecordingError, match=r"/odom: .*heading was never filled"):
            synchronised(make.write(tmp_path / "r"))


def without_heading(motion: Motion) -> Motion:
    """Positions are right, and the orientation is always the same."""
    return replace(motion, rotation=np.repeat(np.eye(3)[None], motion.seconds.size, axis=0))


class TestTwistAgainstPoses:
    @pytest.mark.parametrize("name", ["curves", "circle", "straight", "backwards"])
    def test_kilometres_an_hour_are_refused_by_name(self, tmp_path: Path, name: str) -> None:
        make = with_twist(DRIVES[name], scaled(0, 1, 2, by=3.6))
        with pytest.raises(RecordingError, match=r"/odom: .*3\.\d+ times as far.*km/h"):
            synchronised(make.write(tmp_path / "r"))

    def test_degrees_a_second_are_refused_by_name(self, tmp_path: Path) -> None:
        make = with_twist(CURVES, scaled(5, by=180 / np.pi))
        with pytest.raises(RecordingError, match=r"twist turns 68.*poses turn 1\.19.*degrees"):
            synchronised(make.write(tmp_path / "r"))

    @pytest.mark.parametrize("name", ["curves", "circle", "straight", "backwards"])
    @pytest.mark.parametrize("columns", [(0, 1, 2, 5), (0, 1, 2)])
    def test_a_wrong_sign_is_refused(
        self, tmp_path: Path, name: str, columns: tuple[int, ...]
    ) -> None:
        make = with_twist(DRIVES[name], scaled(*columns, by=-1.0))
        with pytest.raises(RecordingError, match="no frame explains it"):
            synchronised(make.write(tmp_path / "r"))

    @pytest.mark.parametrize("name", ["curves", "circle", "spin", "backwards"])
    def test_a_yaw_rate_of_the_wrong_sign_is_refused(self, tmp_path: Path, name: str) -> None:
        make = with_twist(DRIVES[name], scaled(5, by=-1.0))
        with pytest.raises(RecordingError, match="twist turns"):
            synchronised(make.write(tmp_path / "r"))

    @pytest.mark.parametrize("name", DRIVES)
    def test_wheels_that_slip_by_a_fifth_pass(self, tmp_path: Path, name: str) -> None:
        make = with_twist(DRIVES[name], lambda twist: 1.2 * twist)
        assert kinds(synchronised(make.write(tmp_path / "r"))) == ["motion_agrees"]

    def test_wheels_that_spin_for_long_are_refused_with_both_causes(self, tmp_path: Path) -> None:
        make, motion = Make(), STRAIGHT.at(times(9, 50))
        stuck = (motion.seconds >= 3) & (motion.seconds < 6)
        twist = motion.twist()
        twist[stuck, 0] = 1.5
        step = np.where(stuck, 0.0, motion.twist()[:, 0])
        position = np.zeros_like(motion.position)
        position[1:, 0] = np.cumsum(0.5 * (step[1:] + step[:-1])) / 50
        add_sensors(make)
        add_odometry(make, replace(motion, position=position), twist)
        path = make.write(tmp_path / "r")
        with pytest.raises(RecordingError, match=r"They differ in [34] of .*wheels spin there"):
            synchronised(path)
        for choice, speed in (("differentiated", 0.0), ("body", 1.5)):
            found = synchronised(path, robot(odometry_velocity=choice))
            at_five = np.searchsorted(found.odometry.stamps_ns, START + 5 * SECOND)
            assert found.odometry.velocity[at_five, 0] == pytest.approx(speed, abs=1e-6)

    @pytest.mark.parametrize("noise", [0.003, 0.01])
    def test_a_noisy_robot_that_stands_passes_as_standing(
        self, tmp_path: Path, noise: float
    ) -> None:
        random = np.random.default_rng(3)
        make = Make()
        still = STANDING.at(times(9, 50))
        add_sensors(make)
        shaken = replace(still, position=random.normal(0, noise, still.position.shape))
        add_odometry(make, shaken, random.normal(0, 0.01, (450, 6)))
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found) == ["little_motion"]
        assert worst(found, STANDING) < 0.05
        assert found.plan.rows == ROWS

    def test_a_robot_that_never_moves_makes_rows(self, tmp_path: Path) -> None:
        found = synchronised(drive(STANDING)[0].write(tmp_path / "r"))
        assert (kinds(found), found.plan.rows) == (["little_motion"], ROWS)

    @pytest.mark.parametrize("twist", [True, False])
    def test_limits_that_are_too_low_are_refused_with_advice(
        self, tmp_path: Path, twist: bool
    ) -> None:
        slow = robot(limits=Limits(linear_velocity=(0, 0.2), yaw_rate=(-1, 1)))
        make = with_twist(CURVES, lambda given: given if twist else 0 * given)
        with pytest.raises(RecordingError, match=r"limits of 0\.2 m/s.*Correct `limits`"):
            synchronised(make.write(tmp_path / "r"), slow)

    @pytest.mark.parametrize("choice", ["body", "fixed", "differentiated"])
    def test_the_manifest_can_force_a_choice(self, tmp_path: Path, choice: str) -> None:
        make = drive(CURVES, twist="fixed" if choice == "fixed" else "body")[0]
        found = synchronised(make.write(tmp_path / "r"), robot(odometry_velocity=choice))
        assert kinds(found) == ["velocity_forced"]
        assert worst(found, CURVES) < SMOOTHED

    @pytest.mark.parametrize("held", [10, 20])
    def test_a_pose_that_is_held_until_the_next_one_is_no_jump(
        self, tmp_path: Path, held: int
    ) -> None:
        seconds = times(9, 100)
        shown = CURVES.at(np.floor(seconds * held + 1e-6) / held)
        make = Make()
        add_sensors(make)
        add_odometry(make, replace(shown, seconds=seconds), np.zeros((900, 6)))
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found) == ["twist_never_filled"]
        assert worst(found, CURVES) < 0.05


def moved_from(index: int, by: Callable[[Motion], Motion]) -> Callable[[Motion], Motion]:
    """Another place from a sample on."""

    def change(motion: Motion) -> Motion:
        other = by(motion)
        late = np.arange(motion.seconds.size) >= index
        return replace(
            motion,
            position=np.where(late[:, None], other.position, motion.position),
            rotation=np.where(late[:, None, None], other.rotation, motion.rotation),
        )

    return change


RESETS: dict[str, Callable[[Motion], Motion]] = {
    "to zero": lambda m: replace(m, position=m.position - m.position[225]),
    "by a metre": lambda m: replace(m, position=m.position + np.array([1.0, 0, 0])),
    "aside": lambda m: replace(m, position=m.position + np.array([0, -0.3, 0])),
    "turned": lambda m: m.seen_from(Transform(rotation_from_rpy(0, 0, 1.0), np.zeros(3))),
    "floor": lambda m: replace(m, position=m.position + np.array([0, 0, 3.0])),
}


class TestPosesThatJump:
    @pytest.mark.parametrize("reset", RESETS)
    @pytest.mark.parametrize("twist", [True, False])
    def test_nothing_is_differentiated_across(
        self, tmp_path: Path, reset: str, twist: bool
    ) -> None:
        make = with_poses(CURVES, moved_from(225, RESETS[reset]), twist=twist)
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found)[0] == "pose_jumps"
        assert worst(found, CURVES) < 0.02

    def test_nothing_is_interpolated_across(self, tmp_path: Path) -> None:
        make = with_poses(CURVES, moved_from(225, RESETS["by a metre"]), twist=True)
        series = synchronised(make.write(tmp_path / "r")).odometry
        assert np.flatnonzero(np.diff(series.segment)).tolist() == [224]

    @pytest.mark.parametrize("away", [0.5, 5.0, 1000.0])
    @pytest.mark.parametrize("twist", [True, False])
    def test_spikes_are_left_out_and_counted(
        self, tmp_path: Path, away: float, twist: bool
    ) -> None:
        def spiked(motion: Motion) -> Motion:
            position = motion.position.copy()
            position[[100, 200, 201, 300]] += [away, 0, 0]
            return replace(motion, position=position)

        found = synchronised(with_poses(CURVES, spiked, twist=twist).write(tmp_path / "r"))
        assert kinds(found)[0] == "pose_spikes"
        assert found.findings[0].numbers["spikes"] == 3
        assert found.plan.rows == ROWS
        assert worst(found, CURVES) < SMOOTHED
        assert found.odometry.pose[:, 0].max() < 6

    def test_poses_that_lie_to_and_fro_are_told(self, tmp_path: Path) -> None:
        def shaken(motion: Motion) -> Motion:
            aside = 0.02 * (-1.0) ** np.arange(motion.seconds.size)
            return replace(motion, position=motion.position + aside[:, None] * [0, 1, 0])

        found = synchronised(with_poses(CURVES, shaken, twist=True).write(tmp_path / "r"))
        assert kinds(found)[0] == "poses_scatter"


def inverted(motion: Motion) -> Motion:
    """The odometry frame seen from the body."""
    back = np.swapaxes(motion.rotation, 1, 2)
    position = -np.einsum("nij,nj->ni", back, motion.position)
    return replace(motion, position=position, rotation=back)


def other_publisher(way: Drive, rate: float, late_s: float = 0.003) -> Motion:
    """The same drive told in another frame, at other times."""
    motion = way.at(times(way.seconds, rate) + late_s)
    return motion.seen_from(Transform(rotation_from_rpy(0, 0, 0.5), np.array([3.0, 1, 0])))


class TestOdometryFromTf:
    @pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
    @pytest.mark.parametrize("name", DRIVES)
    def test_one_hop(self, tmp_path: Path, name: str, container: Container) -> None:
        make = Make()
        add_sensors(make)
        add_edge(make, DRIVES[name].at(times(9, 50)))
        found = synchronised(make.write(tmp_path / "r", container), BY_TF)
        assert (kinds(found), found.plan.rows) == (["no_twist"], ROWS)
        assert worst(found, DRIVES[name]) < (0.03 if name == "eight" else SMOOTHED)

    def test_an_edge_that_is_published_the_other_way(self, tmp_path: Path) -> None:
        make = Make()
        add_sensors(make)
        add_edge(make, inverted(CURVES.at(times(9, 50))), ("base_link", "odom"))
        assert worst(synchronised(make.write(tmp_path / "r"), BY_TF), CURVES) < SMOOTHED

    def test_two_moving_hops(self, tmp_path: Path) -> None:
        make, bob = Make(), STANDING.at(times(9, 50))
        add_sensors(make)
        add_edge(make, CURVES.at(times(9, 50)), ("odom", "base_footprint"))
        bob.position[:, 2] = 0.05 * np.sin(bob.seconds)
        add_edge(make, bob, ("base_footprint", "base_link"))
        found = synchronised(make.write(tmp_path / "r"), BY_TF)
        assert worst(found, CURVES) < SMOOTHED
        height = 0.05 * np.sin((found.odometry.stamps_ns - START) / SECOND)
        np.testing.assert_allclose(found.odometry.pose[:, 2], height, atol=1e-6)

    def test_a_fixed_hop_brings_its_lever_arm(self, tmp_path: Path) -> None:
        make, ahead = Make(), Transform(np.eye(3), np.array([-0.3, 0.2, -0.1]))
        hop = (START, "base_footprint", "base_link", (0.3, -0.2, 0.1), NO_TURN)
        add_sensors(make, mountings=(*MOUNTINGS, hop))
        add_edge(make, SPIN.at(times(9, 50)).seen_as(ahead), ("odom", "base_footprint"))
        found = synchronised(make.write(tmp_path / "r"), BY_TF)
        assert worst(found, SPIN) < 1e-6
        np.testing.assert_allclose(found.odometry.pose[:, :3], 0, atol=1e-9)

    @pytest.mark.parametrize("rate", [50.0, 20.0, 5.0])
    def test_two_publishers_are_refused_by_name(self, tmp_path: Path, rate: float) -> None:
        make = Make()
        add_sensors(make)
        add_edge(make, CURVES.at(times(9, 50)))
        add_edge(make, other_publisher(CURVES, rate))
        with pytest.raises(RecordingError, match=r"/tf: two publishers"):
            synchronised(make.write(tmp_path / "r"), BY_TF)

    def test_two_publishers_with_the_same_stamps_are_refused(self, tmp_path: Path) -> None:
        make = Make()
        add_sensors(make)
        add_edge(make, CURVES.at(times(9, 50)))
        add_edge(make, other_publisher(CURVES, 50, late_s=0.0))
        with pytest.raises(RecordingError, match=r"two publishers.*50 % .*repeat a stamp"):
            synchronised(make.write(tmp_path / "r"), BY_TF)

    def test_a_rare_second_publisher_is_left_out_and_told(self, tmp_path: Path) -> None:
        make = Make()
        add_sensors(make)
        add_edge(make, CURVES.at(times(9, 50)))
        add_edge(make, other_publisher(CURVES, 1))
        found = synchronised(make.write(tmp_path / "r"), BY_TF)
        assert kinds(found)[0] == "pose_spikes"
        assert worst(found, CURVES) < SMOOTHED

    def test_a_base_with_two_moving_parents_is_named(self, tmp_path: Path) -> None:
        make = Make()
        add_sensors(make)
        add_edge(make, CURVES.at(times(9, 50)))
        add_edge(make, other_publisher(CURVES, 50), ("map", "base_link"))
        found = synchronised(make.write(tmp_path / "r"), BY_TF)
        assert kinds(found)[0] == "two_parents"
        assert worst(found, CURVES) < SMOOTHED

    def test_transforms_that_are_stamped_ahead_of_time(self, tmp_path: Path) -> None:
        make, still = Make(), STANDING.at(times(9, 20))
        add_sensors(make)
        add_edge(make, CURVES.at(times(9, 50)))
        still.position[:] = [2.0, 1.0, 0.0]
        still.position[:, 0] += 1e-4 * np.arange(180)
        add_edge(make, still, ("map", "odom"), start_ns=START + SECOND // 3, bag_ns=START)
        found = synchronised(
            make.write(tmp_path / "r"), robot(odometry="/tf", odometry_frame="map")
        )
        assert worst(found, CURVES) < 0.015

    def test_a_fixed_edge_is_no_odometry(self, tmp_path: Path) -> None:
        make = Make()
        edge = (START, "odom", "base_link", (0, 0, 0), NO_TURN)
        add_sensors(make, mountings=(*MOUNTINGS, edge))
        make.add("/tf", make.edges([(START, "odom", "base_link", (0, 0, 0), NO_TURN)]), START)
        with pytest.raises(RecordingError, match=r"never moves, and a fixed edge is no odometry"):
            synchronised(make.write(tmp_path / "r"), BY_TF)


class TestOdometryOfOtherFrames:
    """Cameras that track, mounted anyhow: RealSense T265, ORB-SLAM, ZED."""

    BACKWARDS_MOUNTED = Transform(rotation_from_rpy(0, 0, np.pi), np.array([-0.3, 0.1, 0.2]))
    ASLANT = Transform(rotation_from_rpy(0.1, 0.4, 0.8), np.array([0.3, 0.0, 0.3]))
    CAMERA = ASLANT @ Transform.from_quaternion(np.zeros(3), np.array(OPTICAL))

    @pytest.mark.parametrize("mounting", [BACKWARDS_MOUNTED, ASLANT, CAMERA])
    @pytest.mark.parametrize("twist", ["body", "fixed", "none"])
    @pytest.mark.parametrize("level", [True, False])
    def test_is_carried_over_to_the_base(
        self, tmp_path: Path, mounting: Transform, twist: str, level: bool
    ) -> None:
        turn = quaternion_from_rotation(mounting.rotation[None])[0].tolist()
        make, place = Make(), mounting.translation.tolist()
        add_sensors(make, mountings=(*MOUNTINGS, (START, "base_link", "tracker", place, turn)))
        motion = CURVES.at(times(9, 50)).seen_as(mounting)
        if not level:
            motion = motion.seen_from(mounting.inverse())
        given_twist = 0 * motion.twist() if twist == "none" else motion.twist(twist)
        add_odometry(make, motion, given_twist, frames=("world", "tracker"))
        found = synchronised(make.write(tmp_path / "r"))
        assert worst(found, CURVES) < SMOOTHED
        np.testing.assert_allclose(found.odometry.pose[:, 3:5], 0, atol=1e-6 if level else 0.5)

    def test_a_camera_s_own_world_is_turned_upright(self, tmp_path: Path) -> None:
        optical = Transform.from_quaternion(np.zeros(3), np.array(OPTICAL))
        make = Make()
        add_sensors(make)
        add_odometry(make, CURVES.at(times(9, 50)).seen_from(optical.inverse()))
        found = synchronised(make.write(tmp_path / "r"))
        assert "odometry_frame_not_level" in kinds(found)
        assert worst(found, CURVES) < 1e-6
        np.testing.assert_allclose(found.odometry.pose[:, [2, 3, 4]], 0, atol=1e-6)
        turned = found.odometry.pose[:, 5] - found.odometry.pose[0, 5]
        truth = CURVES.at(times(9, 50)).rotation
        np.testing.assert_allclose(turned, np.arctan2(truth[:, 1, 0], truth[:, 0, 0]), atol=1e-6)

    @pytest.mark.parametrize("twist", ["body", "none"])
    def test_a_camera_that_nothing_connects_is_refused(self, tmp_path: Path, twist: str) -> None:
        optical = Transform.from_quaternion(np.zeros(3), np.array(OPTICAL))
        motion = CURVES.at(times(9, 50)).seen_as(optical).seen_from(optical.inverse())
        make = Make()
        add_sensors(make)
        given_twist = 0 * motion.twist() if twist == "none" else motion.twist()
        add_odometry(make, motion, given_twist, frames=("slam", "slam_camera"))
        with pytest.raises(RecordingError, match=r"along the robot's x axis.*another odometry"):
            synchronised(make.write(tmp_path / "r"))

    def test_one_that_looks_back_is_told(self, tmp_path: Path) -> None:
        make, motion = Make(), CURVES.at(times(9, 50)).seen_as(self.BACKWARDS_MOUNTED)
        add_sensors(make)
        add_odometry(make, motion, frames=("world", "tracker"))
        ahead = robot(limits=Limits(linear_velocity=(0, 2), yaw_rate=(-1.5, 1.5)))
        found = synchronised(make.write(tmp_path / "r"), ahead)
        assert {"odometry_of_other_frame", "drives_backwards"} <= set(kinds(found))


class TestOtherMessagesOfMotion:
    @pytest.mark.parametrize("rate", [10.0, 30.0, 100.0])
    def test_poses_alone(self, tmp_path: Path, rate: float) -> None:
        make, motion = Make(), CURVES.at(times(9, rate))
        add_sensors(make)
        quaternions = quaternion_from_rotation(motion.rotation)
        for k, second in enumerate(motion.seconds.tolist()):
            at_ns = START + round(second * SECOND)
            pose = make.pose(motion.position[k], quaternions[k])
            stamped = make.c["geometry_msgs/msg/PoseStamped"](make.header(at_ns, "odom"), pose)
            make.add("/odom", stamped, at_ns + 2_000_000)
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found) == ["no_twist"]
        assert worst(found, CURVES) < 0.03

    @pytest.mark.parametrize("rate", [10.0, 30.0, 100.0])
    def test_a_twist_alone(self, tmp_path: Path, rate: float) -> None:
        make, motion = Make(), CURVES.at(times(9, rate))
        add_sensors(make)
        for k, second in enumerate(motion.seconds.tolist()):
            at_ns = START + round(second * SECOND)
            twist = make.twist(motion.twist()[k].tolist())
            kind = make.c["geometry_msgs/msg/TwistStamped"]
            make.add("/odom", kind(make.header(at_ns, "base_link"), twist), at_ns + 2_000_000)
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found) == ["no_poses"]
        assert worst(found, CURVES) < 1e-6
        np.testing.assert_allclose(found.odometry.pose[:, :3], motion.position, atol=5e-3)


def spot(make: Make, motion: Motion, *, static: bool, inverse: bool) -> None:
    """The habits of Spot's drivers: base ``body``, twist in odom, all transforms on /tf."""
    mountings = tuple((START, "body", child, t, q) for _, _, child, t, q in MOUNTINGS)
    add_sensors(make, frames=("camera", "odom"), mountings=mountings if static else ())
    add_odometry(make, motion, motion.twist("fixed"), frames=("odom", "body"))
    if not static:
        for second in times(9, 20).tolist():
            at_ns = START + round(second * SECOND)
            edges = [(at_ns, *edge[1:]) for edge in mountings]
            make.add("/tf", make.edges(edges), at_ns + 1_000_000)
    if inverse:
        add_edge(make, inverted(motion), ("body", "odom"))
    else:
        add_edge(make, motion, ("odom", "body"))


class TestSpot:
    @pytest.mark.parametrize("static", [True, False])
    @pytest.mark.parametrize("inverse", [True, False])
    @pytest.mark.parametrize("name", ["curves", "circle", "straight", "backwards"])
    @pytest.mark.parametrize("container", ["bag", "mcap"])
    def test_all_habits_at_once(
        self, tmp_path: Path, name: str, static: bool, inverse: bool, container: Container
    ) -> None:
        way = replace(DRIVES[name], heading=2.0)
        make, motion = Make(), way.at(times(9, 50))
        spot(make, motion, static=static, inverse=inverse)
        found = synchronised(make.write(tmp_path / "r", container), robot(base_frame="body"))
        assert {"cloud_in_other_frame", "twist_in_fixed_frame"} <= set(kinds(found))
        assert worst(found, way) < 1e-6
        assert found.plan.rows == ROWS
        lidar = found.placement.transforms.lookup("body", "lidar", START + 3 * SECOND)
        np.testing.assert_allclose(lidar.translation, MOUNTINGS[0][3], atol=1e-9)
        at_ns = int(found.points_ns[30])
        body = found.placement.transforms.lookup("odom", "body", at_ns)
        truth = way.at(np.array([(at_ns - START) / SECOND]))
        np.testing.assert_allclose(body.translation, truth.position[0], atol=1e-3)
        np.testing.assert_allclose(body.rotation, truth.rotation[0], atol=1e-6)


class TestMountings:
    def test_fixed_edges_that_are_repeated_on_tf(self, tmp_path: Path) -> None:
        make, motion = Make(), CURVES.at(times(9, 50))
        add_sensors(make, mountings=())
        add_odometry(make, motion)
        for second in times(9, 50).tolist():
            at_ns = START + round(second * SECOND)
            make.add("/tf", make.edges([(at_ns, *e[1:]) for e in MOUNTINGS]), at_ns)
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found) == ["motion_agrees"]
        assert lidar_places(found) == [MOUNTINGS[0][3]]

    def test_a_transform_that_was_corrected_before_the_first_row(self, tmp_path: Path) -> None:
        make = drive()[0]
        right = (START, "base_link", "lidar", (0.2, 0.0, 0.6), NO_TURN)
        make.add("/tf_static", make.edges([right]), START + SECOND // 2)
        found = synchronised(make.write(tmp_path / "r"))
        anchors = found.plan.anchor_ns
        poses = found.placement.transforms.poses("base_link", "lidar", anchors)
        np.testing.assert_allclose(poses.translation, [[0.2, 0, 0.6]] * anchors.size)

    @pytest.mark.parametrize(("number", "child"), [(0, "lidar"), (1, "camera")])
    @pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
    def test_a_mounting_that_changed_in_mid_run(
        self, tmp_path: Path, number: int, child: str, container: Container
    ) -> None:
        make = drive()[0]
        _, parent, _, _, turn = MOUNTINGS[number]
        moved = (START, parent, child, (0.1, 0.1, 0.9), turn)
        make.add("/tf_static", make.edges([moved]), START + 5 * SECOND)
        found = synchronised(make.write(tmp_path / "r", container))
        assert "mounting_changed" in kinds(found)
        buffer = found.placement.transforms
        before = buffer.lookup("base_link", child, START + int(4.9 * SECOND)).translation
        after = buffer.lookup("base_link", child, START + int(5.0 * SECOND)).translation
        assert before.tolist() == list(MOUNTINGS[number][3])
        assert after.tolist() == [0.1, 0.1, 0.9]

    @pytest.mark.parametrize("first", [True, False])
    def test_of_two_parents_the_one_published_last_counts(
        self, tmp_path: Path, first: bool
    ) -> None:
        mast = (START, "base_link", "mast", (0, 0, 1.0), NO_TURN)
        other = (START, "mast", "lidar", (0, 0, 1.0), NO_TURN)
        edges = (mast, other, *MOUNTINGS) if first else (*MOUNTINGS, mast, other)
        make = Make()
        add_sensors(make, mountings=())
        for number, edge in enumerate(edges):
            make.add("/tf_static", make.edges([edge]), START + number)
        add_odometry(make, CURVES.at(times(9, 50)))
        found = synchronised(make.write(tmp_path / "r"))
        assert "two_parents" in kinds(found)
        assert lidar_places(found) == [MOUNTINGS[0][3] if first else (0.0, 0.0, 2.0)]

    @pytest.mark.parametrize(
        ("place", "turn"),
        [
            ((0, 0, 1), (0.0, 0.0, 0.0, 0.0)),
            ((0, 0, 1), (0.0, 0.0, 0.0, float("nan"))),
            ((0, float("inf"), 1), NO_TURN),
        ],
    )
    @pytest.mark.parametrize("first", [True, False])
    def test_an_edge_that_is_no_transform_is_skipped_alone(
        self, tmp_path: Path, place: Any, turn: Any, first: bool
    ) -> None:
        none = (START, "base_link", "gripper", place, turn)
        make = Make()
        add_sensors(make, mountings=(none, *MOUNTINGS) if first else (*MOUNTINGS, none))
        add_odometry(make, CURVES.at(times(9, 50)))
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found) == ["edge_unusable", "motion_agrees"]
        assert "base_link -> gripper" in found.findings[0].text
        assert lidar_places(found) == [MOUNTINGS[0][3]]

    def test_of_two_robots_each_has_its_own(self, tmp_path: Path) -> None:
        make = Make()
        other = ((START, "base_link", "lidar", (0.2, 0.0, 1.1), NO_TURN), MOUNTINGS[1])
        for space, way, mountings in (("/r1", CURVES, MOUNTINGS), ("/r2", SPIN, other)):
            add_sensors(make, space=space, mountings=mountings)
            add_odometry(make, way.at(times(9, 50)), topic=f"{space}/odom")
            add_edge(make, way.at(times(9, 50)), topic=f"{space}/tf")
        path = make.write(tmp_path / "r")
        for space, way, height in (("/r1", CURVES, 0.4), ("/r2", SPIN, 1.1)):
            for topic in ("odom", "tf"):
                own = robot(
                    image=f"{space}/camera/image",
                    points=f"{space}/points",
                    odometry=f"{space}/{topic}",
                )
                found = synchronised(path, own)
                assert lidar_places(found) == [(0.2, 0.0, height)]
                assert worst(found, way) < SMOOTHED


def lidar_places(found: Any) -> list[tuple[float, ...]]:
    """Where the lidar is, one place after another."""
    changes = found.placement.transforms.changes("base_link", "lidar")
    return [tuple(np.round(t.translation, 9).tolist()) for _, t in changes]


FIRST, SECOND_DRIVE = replace(CURVES, seconds=7.0), replace(CIRCLE, seconds=7.0, start=(5, 2, 0))
AGAIN = {
    "the same stamps": (START, START, START + 20 * SECOND),
    "stamps that overlap by half": (START, START + 3 * SECOND, START + 8 * SECOND),
    "stamps and bag time begin again": (START, START, START),
    "both go back by half a minute": (START, START - 30 * SECOND, START - 30 * SECOND),
    "simulated time from zero": (5 * SECOND, 5 * SECOND, START + 8 * SECOND),
    "a clock set forwards": (START, START + 107 * SECOND, START + 7 * SECOND),
    "a clock set back a little": (START, START + 4 * SECOND, START + 7 * SECOND),
    "a clock set back far": (START, START - 100 * SECOND, START + 7 * SECOND),
}


def twice(case: str, *, by_tf: bool) -> Make:
    """Two drives in one recording; stamps of either, and when the recorder got the second."""
    first_ns, second_ns, bag_ns = AGAIN[case]
    make = Make()
    parts = ((FIRST, first_ns, START, MOUNTINGS), (SECOND_DRIVE, second_ns, bag_ns, ()))
    for way, start_ns, begin_ns, mountings in parts:
        part, motion = Make(), way.at(times(7, 50))
        add_sensors(part, 7, start_ns=start_ns, bag_ns=begin_ns, mountings=mountings)
        if by_tf:
            add_edge(part, motion, start_ns=start_ns, bag_ns=begin_ns)
        else:
            add_odometry(part, motion, start_ns=start_ns, bag_ns=begin_ns)
        make.messages += sorted(part.messages, key=lambda message: message[2])
    return make


class TestStampsThatBeginAgain:
    @pytest.mark.parametrize("case", AGAIN)
    @pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
    @pytest.mark.parametrize("by_tf", [False, True])
    def test_nothing_is_mixed(
        self, tmp_path: Path, case: str, container: Container, by_tf: bool
    ) -> None:
        make = twice(case, by_tf=by_tf)
        path = make.write(tmp_path / "r", container, sort=False)
        found = synchronised(path, BY_TF if by_tf else ROBOT)
        assert kinds(found)[0] == "stamps_begin_again"
        assert found.plan.rows == 2 * 51
        assert (np.diff(found.plan.anchor_ns) > 0).all()
        if AGAIN[case][2] >= START + 7 * SECOND:
            # Else the reader yields messages by bag time, in which both runs take turns.
            assert found.plan.image.tolist() == [*range(9, 60), *range(79, 130)]
        assert found.plan.points.tolist() == found.plan.image.tolist()
        history = found.plan.history
        for part, way in ((history[:51], FIRST), (history[51:], SECOND_DRIVE)):
            back = np.arange(9, -1, -1) * 0.1
            seconds = 0.9 + 0.1 * np.arange(51)[:, None] - back
            truth = way.at(seconds.ravel()).velocity.reshape(51, 10, 2)
            np.testing.assert_allclose(part, truth, atol=0.02 if by_tf else 1e-4)

    @pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
    @pytest.mark.parametrize("clock", [False, True])
    def test_a_playback_that_loops_three_times(
        self, tmp_path: Path, container: Container, clock: bool
    ) -> None:
        make = Make()
        for turn in range(3):
            part, begin = Make(), START if clock else START + turn * 8 * SECOND
            add_sensors(part, 7, bag_ns=begin, mountings=() if turn else MOUNTINGS)
            add_odometry(part, FIRST.at(times(7, 50)), bag_ns=begin)
            make.messages += sorted(part.messages, key=lambda message: message[2])
        found = synchronised(make.write(tmp_path / "r", container, sort=False))
        assert found.findings[0].numbers == {"stretches": 3}
        assert found.plan.rows == 3 * 51
        np.testing.assert_allclose(found.plan.history[:51], found.plan.history[51:102], atol=1e-6)

    def test_transforms_before_the_sensors_stay_in_their_stretch(self, tmp_path: Path) -> None:
        make = Make()
        for turn in range(2):
            begin = START + turn * 40 * SECOND
            add_sensors(make, 7, start_ns=START + 20 * SECOND, bag_ns=begin + 20 * SECOND)
            motion = replace(FIRST, seconds=27.0).at(times(27, 50))
            add_edge(make, motion, bag_ns=begin)
            odometry = replace(motion, seconds=motion.seconds)
            late = odometry.seconds >= 20
            part = Motion(*(getattr(odometry, f)[late] for f in Motion.__dataclass_fields__))
            add_odometry(make, part, bag_ns=begin)
        found = synchronised(make.write(tmp_path / "r"))
        edge = found.placement.transforms.edges["odom", "base_link"]
        assert (np.diff(edge.stamps_ns) > 0).all()
        assert found.plan.rows == 2 * 51

    def test_a_stretch_without_a_lidar_makes_no_rows_and_is_named(self, tmp_path: Path) -> None:
        make = Make()
        for begin, clouds in ((START, True), (START + 8 * SECOND, False)):
            add_sensors(make, 7, bag_ns=begin, clouds=clouds)
            add_odometry(make, FIRST.at(times(7, 50)), bag_ns=begin)
        found = synchronised(make.write(tmp_path / "r"))
        assert found.plan.rows == 51
        assert kinds(found)[:2] == ["stamps_begin_again", "stretch_without_rows"]
        assert "no message on /points" in found.findings[1].text
        assert sum(found.plan.lost.values()) == 19 + 70


def set_in_mid_run(make: Make, seconds: float, topic: str | None) -> Make:
    """Header stamps move by some seconds after six, of one topic or of all."""
    for k, (name, message, bag_ns) in enumerate(make.messages):
        late = bag_ns > START + 6 * SECOND and hasattr(message, "header")
        if late and topic in (None, name):
            stamp = message.header.stamp
            moved = stamp.sec * SECOND + stamp.nanosec + round(seconds * SECOND)
            head = make.header(moved, message.header.frame_id)
            make.messages[k] = name, replace(message, header=head), bag_ns
    return make


class TestClocksThatAreSet:
    TWELVE = replace(CURVES, seconds=12.0)

    @pytest.mark.parametrize("seconds", [0.6, 3.0, 100.0, -0.6, -3.0, -100.0])
    def test_all_of_them(self, tmp_path: Path, seconds: float) -> None:
        make = set_in_mid_run(drive(self.TWELVE)[0], seconds, None)
        found = synchronised(make.write(tmp_path / "r"))
        assert found.plan.rows == 82
        assert not found.plan.points_age_ns.any()
        assert kinds(found) == ["stamps_begin_again", "motion_agrees"]

    @pytest.mark.parametrize("seconds", [0.6, 3.0, 100.0, -0.6, -3.0, -100.0])
    @pytest.mark.parametrize("topic", ["/points", "/odom", "/camera/image"])
    def test_one_sensor_alone_costs_the_stretch_in_which_it_is_wrong(
        self, tmp_path: Path, seconds: float, topic: str
    ) -> None:
        make = set_in_mid_run(drive(self.TWELVE)[0], seconds, topic)
        found = synchronised(make.write(tmp_path / "r"))
        assert kinds(found)[:2] == ["stamps_begin_again", "stretch_without_rows"]
        assert "clocks differ" in found.findings[1].text
        assert found.plan.rows in (41, 42)
        assert found.plan.image.max() < 60
        assert worst(found, self.TWELVE) < 1e-6

    @pytest.mark.parametrize("topic", ["/points", "/odom"])
    @pytest.mark.parametrize("seconds", [0.3, -0.45])
    def test_a_small_step_is_refused_or_cut(
        self, tmp_path: Path, topic: str, seconds: float
    ) -> None:
        make = set_in_mid_run(drive(self.TWELVE)[0], seconds, topic)
        try:
            found = synchronised(make.write(tmp_path / "r"))
        except RecordingError as error:
            refusal = str(error)
        else:
            refusal = "clocks differ" if found.plan.image.max() < 60 else "rows were mixed"
        assert "clocks differ" in refusal

    def test_a_lidar_that_counts_from_when_it_was_switched_on(self, tmp_path: Path) -> None:
        make = Make()
        add_sensors(make, clouds=False)
        add_odometry(make, CURVES.at(times(9, 50)))
        for second in times(9, 10).tolist():
            at_ns = round(second * SECOND)
            cloud = make.cloud(123_400_000_000 + at_ns)
            make.add("/points", cloud, START + at_ns + 50_000_000)
        path = make.write(tmp_path / "r")
        with pytest.raises(RecordingError, match=r"/points.*constant.*`offset_s: measured`"):
            synchronised(path)
        points = ROBOT.clocks.points.model_copy(update={"offset_s": "measured", "latency_s": 0.02})
        found = synchronised(path, robot(clocks=ROBOT.clocks.model_copy(update={"points": points})))
        assert found.plan.rows == ROWS
        assert np.abs(found.plan.points_age_ns).max() < 1_000_000


class TestOrders:
    @pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
    @pytest.mark.parametrize("order", ["topic by topic", "within a third of a second", "shuffled"])
    def test_the_order_of_writing_does_not_matter(
        self, tmp_path: Path, order: str, container: Container
    ) -> None:
        make, random = drive(CURVES, twist="fixed")[0], np.random.default_rng(0)
        ordered = {
            "topic by topic": lambda m: (m[0], m[2]),
            "within a third of a second": lambda m: m[2] + random.uniform(0, 0.3e9),
            "shuffled": lambda _: random.uniform(),
        }
        make.messages.sort(key=ordered[order])
        found = synchronised(make.write(tmp_path / "r", container, sort=False))
        assert kinds(found) == ["twist_in_fixed_frame"]
        assert found.plan.rows == ROWS
        assert worst(found, CURVES) < 1e-6

    def test_a_recorder_that_stalls_is_no_restart(self, tmp_path: Path) -> None:
        make = drive()[0]
        low, high = START + 4 * SECOND, START + int(5.5 * SECOND)
        make.messages = [(t, m, high if low < at < high else at) for t, m, at in make.messages]
        found = synchronised(make.write(tmp_path / "r"))
        assert (kinds(found), found.plan.rows) == (["motion_agrees"], ROWS)


class TestCommands:
    @pytest.mark.parametrize(
        ("v", "omega", "kind"),
        [
            (0.6, 0.8, "commands_agree"),
            (-0.6, 0.8, "commands_opposite"),
            (0.6, -0.8, "commands_opposite"),
            (2.0, 0.8, "commands_differ"),
        ],
    )
    def test_are_held_against_the_odometry(
        self, tmp_path: Path, v: float, omega: float, kind: str
    ) -> None:
        make = drive(CIRCLE)[0]
        for second in times(9, 10).tolist():
            make.add("/cmd", make.twist([v, 0, 0, 0, 0, omega]), START + round(second * SECOND))
        found = synchronised(make.write(tmp_path / "r"), robot(command="/cmd"))
        assert kinds(found) == ["motion_agrees", kind]

    def test_an_odometry_that_was_never_filled_is_refused(self, tmp_path: Path) -> None:
        make = drive(STANDING)[0]
        for second in times(9, 10).tolist():
            make.add("/cmd", make.twist([0.5, 0, 0, 0, 0, 0]), START + round(second * SECOND))
        with pytest.raises(RecordingError, match=r"/cmd asks for 4\.\d m.*never filled"):
            synchronised(make.write(tmp_path / "r"), robot(command="/cmd"))
