"""Each rule on motions whose failures are known by construction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from graspe_data.arrays import Floats
from graspe_data.observation.labels.collision import CollisionSettings, collision_events
from graspe_data.observation.labels.events import Event
from graspe_data.observation.labels.oscillation import OscillationSettings, oscillation_events
from graspe_data.observation.labels.stuck import StuckSettings, stuck_events
from graspe_data.observation.labels.stumble import StumbleSettings, stumble_events

Build = Callable[..., Any]


def ramp(*corners: tuple[float, float]) -> Callable[[Floats], Floats]:
    """A piecewise linear profile through (second, value) corners."""
    seconds, values = zip(*corners, strict=True)
    return lambda times: np.interp(times, seconds, values)


def seconds_of(event: Event, start_ns: int) -> tuple[float, float]:
    return (event.start_ns - start_ns) * 1e-9, (event.stop_ns - start_ns) * 1e-9


class TestStuck:
    def test_a_robot_held_while_commanded_is_stuck_for_as_long(
        self, drive: Build, command: Build, start_ns: int
    ) -> None:
        held = drive(ramp((0, 0.5), (4, 0.5), (4.1, 0), (7, 0), (7.2, 0.5)))
        (event,) = stuck_events(held, command(0.5), StuckSettings())
        assert event.kind == "stuck"
        assert seconds_of(event, start_ns) == pytest.approx((4.1, 7.05), abs=0.1)

    def test_a_robot_that_follows_its_command_is_not(self, drive: Build, command: Build) -> None:
        assert stuck_events(drive(0.5), command(0.5), StuckSettings()) == []

    def test_standing_still_without_a_command_is_no_failure(
        self, drive: Build, command: Build
    ) -> None:
        assert stuck_events(drive(0.0), command(0.0), StuckSettings()) == []

    def test_a_command_that_ceased_no_longer_holds(self, drive: Build, command: Build) -> None:
        assert stuck_events(drive(0.0), command(0.5, seconds=0.4), StuckSettings()) == []

    def test_starting_is_given_a_second(self, drive: Build, command: Build) -> None:
        starting = drive(ramp((0, 0), (0.5, 0), (2, 1.0)))
        assert stuck_events(starting, command(1.0), StuckSettings()) == []

    def test_turning_on_the_spot_does_not_answer_a_command_to_drive(
        self, drive: Build, command: Build
    ) -> None:
        assert stuck_events(drive(0.0, 0.5), command(0.5, 0.5), StuckSettings())
        assert not stuck_events(drive(0.0, 0.5), command(0.0, 0.5), StuckSettings())
        assert stuck_events(drive(0.0, 0.0), command(0.0, 0.5), StuckSettings())

    @pytest.mark.parametrize("way", [-1.0, 1.0])
    def test_noise_frees_no_robot_that_creeps(
        self, drive: Build, command: Build, start_ns: int, way: float
    ) -> None:
        noise = np.random.default_rng(0).normal(0.0, 0.005, 501)
        creeping = drive(lambda times: way * 0.09 + np.resize(noise, times.shape), rate=50.0)
        (event,) = stuck_events(creeping, command(way * 0.5), StuckSettings())
        assert seconds_of(event, start_ns) == pytest.approx((0.0, 10.0), abs=0.1)
        assert not any(
            event.stop_ns - event.start_ns > 9e9
            for event in stuck_events(creeping, command(way * 0.5), StuckSettings(window_s=0.0))
        )

    def test_a_robot_that_goes_the_other_way_moves(self, drive: Build, command: Build) -> None:
        assert stuck_events(drive(-0.3), command(0.5), StuckSettings()) == []

    def test_nothing_is_concluded_across_a_gap(self, drive: Build, command: Build) -> None:
        whole = drive(0.0, seconds=3.0, rate=10.0)
        keep = np.abs(np.arange(31) - 15) > 7
        cut = type(whole)(*(value[keep] for value in vars(whole).values() if value is not None))
        assert stuck_events(whole, command(0.5), StuckSettings())
        assert stuck_events(cut, command(0.5), StuckSettings()) == []


class TestCollision:
    @pytest.mark.parametrize("rate", [10.0, 20.0, 50.0, 200.0])
    @pytest.mark.parametrize("speed", [0.4, 1.0, 10.0])
    def test_a_wall_is_found_at_any_rate_and_speed(
        self, drive: Build, start_ns: int, rate: float, speed: float
    ) -> None:
        wall = drive(ramp((0, speed), (5.03, speed), (5.03 + speed / 40, 0)), rate=rate)
        (event,) = collision_events(wall, None, None, CollisionSettings())
        assert event.kind == "collision"
        assert seconds_of(event, start_ns) == pytest.approx((5.0, 5.2), abs=0.25)

    def test_a_brake_to_a_stop_is_none(self, drive: Build) -> None:
        brake = drive(ramp((0, 2.3), (2, 1.7), (6, 0)), rate=10.0)
        assert collision_events(brake, None, None, CollisionSettings()) == []

    def test_a_long_hard_brake_is_none(self, drive: Build) -> None:
        brake = drive(ramp((0, 10), (5, 10), (6.25, 0)))
        assert collision_events(brake, None, None, CollisionSettings()) == []

    def test_noise_about_rest_is_none(self, drive: Build) -> None:
        noise = drive(lambda times: np.where(np.floor(times * 10) % 4 == 0, 0.4, -0.1), rate=10.0)
        assert collision_events(noise, None, None, CollisionSettings()) == []

    def test_losing_some_speed_is_none(self, drive: Build) -> None:
        slowed = drive(ramp((0, 2), (5, 2), (5.1, 1.2)))
        assert collision_events(slowed, None, None, CollisionSettings()) == []

    def test_driving_backwards_into_something_is_one(self, drive: Build) -> None:
        assert collision_events(
            drive(ramp((0, -1), (5, -1), (5.05, 0))), None, None, CollisionSettings()
        )

    def test_the_soft_hit_of_a_walking_robot_is_one_where_the_imu_feels_it(
        self, drive: Build, command: Build, inertial: Build
    ) -> None:
        hit = drive(ramp((0, 0.24), (5, 0.24), (5.02, 0)), rate=50.0)
        footfalls = inertial(lambda times: 4 * np.maximum(np.cos(8 * np.pi * times), 0) ** 4)
        felt = inertial(lambda times: np.where(np.abs(times - 5.01) < 0.012, -12.0, 0.0))
        assert collision_events(hit, command(0.5), footfalls, CollisionSettings()) == []
        assert len(collision_events(hit, command(0.5), felt, CollisionSettings())) == 1

    def test_a_hit_soon_after_the_start_is_one(self, drive: Build, command: Build) -> None:
        started = drive(ramp((0, 0), (2, 0), (2.5, 0.5), (2.52, 0)), rate=50.0)
        assert len(collision_events(started, command(0.5), None, CollisionSettings())) == 1

    def test_a_hit_while_told_to_stop_is_one_where_it_is_harder_than_a_brake(
        self, drive: Build, command: Build, inertial: Build
    ) -> None:
        stop = drive(ramp((0, 0.5), (5, 0.5), (5.02, 0)), rate=50.0)
        told = command(lambda times: np.where(times >= 4.99, 0.0, 0.5), rate=50.0)
        braked = inertial(lambda times: np.where(np.abs(times - 5.05) < 0.05, -8.0, 0.0))
        hit = inertial(lambda times: np.where(np.abs(times - 5.01) < 0.012, -20.0, 0.0))
        footfall = inertial(lambda times: np.where(np.abs(times - 5.3) < 0.012, 20.0, 0.0))
        assert collision_events(stop, told, braked, CollisionSettings()) == []
        assert collision_events(stop, told, footfall, CollisionSettings()) == []
        assert len(collision_events(stop, told, hit, CollisionSettings())) == 1

    def test_a_gentle_stop_that_was_told_is_none_whatever_the_imu_feels(
        self, drive: Build, command: Build, inertial: Build
    ) -> None:
        stop = drive(ramp((0, 0.5), (5, 0.5), (5.25, 0)), rate=50.0)
        told = command(lambda times: np.where(times >= 4.9, 0.0, 0.5), rate=50.0)
        shaken = inertial(lambda times: 25.0 * np.sin(2 * np.pi * 20 * times))
        assert collision_events(stop, told, shaken, CollisionSettings()) == []

    @pytest.mark.parametrize("lead_s", [0.0, 0.2, 0.4])
    def test_a_commanded_stop_is_none(self, drive: Build, command: Build, lead_s: float) -> None:
        stop = drive(ramp((0, 1), (5, 1), (5.2, 0)))
        told = command(lambda times: np.where(times >= 4.99 - lead_s, 0.0, 1.0), rate=50.0)
        assert collision_events(stop, told, None, CollisionSettings()) == []
        assert collision_events(stop, command(1.0), None, CollisionSettings())

    def test_commands_that_cease_are_a_stop(self, drive: Build, command: Build) -> None:
        stop = drive(ramp((0, 1), (5, 1), (5.2, 0)))
        assert collision_events(stop, command(1.0, seconds=4.4), None, CollisionSettings()) == []
        driven_by_other_means = command(1.0, seconds=1.0)
        assert collision_events(stop, driven_by_other_means, None, CollisionSettings())

    def test_a_peak_of_the_imu_supports_a_smoothed_odometry(
        self, drive: Build, inertial: Build
    ) -> None:
        smoothed = drive(ramp((0, 0.5), (5, 0.5), (5.3, 0)))
        peak = inertial(lambda times: np.where(np.abs(times - 5.05) < 0.015, -30.0, 0.0))
        assert collision_events(smoothed, None, inertial(), CollisionSettings()) == []
        assert len(collision_events(smoothed, None, peak, CollisionSettings())) == 1
        assert collision_events(drive(0.5), None, peak, CollisionSettings()) == []


class TestOscillation:
    def test_turning_to_and_fro_in_place_is_found_from_first_to_last_reversal(
        self, drive: Build, start_ns: int
    ) -> None:
        def swing(times: Floats) -> Floats:
            return np.where((times > 2) & (times < 12), np.sin(2 * np.pi * (times - 2) / 2), 0.0)

        (event,) = oscillation_events(drive(0.0, swing, seconds=15), OscillationSettings())
        assert seconds_of(event, start_ns) == pytest.approx((3.05, 11.05), abs=0.1)

    def test_a_slalom_that_gets_somewhere_is_none(self, drive: Build) -> None:
        slalom = drive(0.6, lambda times: np.sin(2 * np.pi * times / 2))
        assert oscillation_events(slalom, OscillationSettings()) == []

    def test_the_sway_of_a_gait_is_none(self, drive: Build) -> None:
        sway = drive(0.5, lambda times: 0.4 * np.sin(2 * np.pi * 4 * times), rate=50.0)
        assert oscillation_events(sway, OscillationSettings()) == []

    def test_spinning_one_way_is_none(self, drive: Build) -> None:
        assert oscillation_events(drive(0.0, 1.0), OscillationSettings()) == []

    def test_noise_below_the_threshold_is_none(self, drive: Build) -> None:
        tremble = drive(0.0, lambda times: 0.15 * np.sin(40 * times))
        assert oscillation_events(tremble, OscillationSettings()) == []

    def test_two_reversals_are_not_enough(self, drive: Build) -> None:
        twice = drive(0.0, ramp((0, 1), (3, 1), (3.1, -1), (4, -1), (4.1, 1), (5, 0)))
        assert oscillation_events(twice, OscillationSettings()) == []
        assert oscillation_events(twice, OscillationSettings(reversals=2))


class TestStumble:
    def test_a_pitch_is_found(self, drive: Build, inertial: Build, start_ns: int) -> None:
        pitched = inertial(pitch_rate=lambda times: np.where(np.abs(times - 5) < 0.2, 2.0, 0.0))
        (event,) = stumble_events(drive(0.5), pitched, StumbleSettings())
        assert seconds_of(event, start_ns) == pytest.approx((4.8, 5.2), abs=0.06)
        assert event.evidence == "tilt rate"

    @pytest.mark.parametrize("gravity", [9.81, 0.0])
    def test_a_push_is_found_with_and_without_gravity(
        self, drive: Build, inertial: Build, gravity: float
    ) -> None:
        pushed = inertial(
            lambda times: np.where(np.abs(times - 5) < 0.1, 12.0, 0.0), gravity=gravity
        )
        (event,) = stumble_events(drive(0.5), pushed, StumbleSettings())
        assert event.evidence == "acceleration"

    def test_spinning_is_no_tilt_however_the_imu_is_mounted(
        self, drive: Build, inertial: Build
    ) -> None:
        spinning = replace(inertial(), gyro=np.tile([0.0, 0.0, 3.0], (1001, 1)))
        on_its_side = replace(
            spinning, gyro=spinning.gyro[:, [0, 2, 1]], accel=spinning.accel[:, [0, 2, 1]]
        )
        for imu in (spinning, on_its_side, replace(spinning, accel=np.zeros((1001, 3)))):
            assert stumble_events(drive(0.0, 3.0), imu, StumbleSettings()) == []

    def test_a_robot_on_a_slope_or_at_rest_does_not_stumble(
        self, drive: Build, inertial: Build
    ) -> None:
        assert stumble_events(drive(0.5), inertial(5.0), StumbleSettings()) == []

    def test_vibration_cancels(self, drive: Build, inertial: Build) -> None:
        shaking = inertial(lambda times: 20 * np.sin(2 * np.pi * 30 * times))
        assert stumble_events(drive(0.5), shaking, StumbleSettings()) == []

    def test_without_imu_the_attitude_of_the_odometry_tells(self, drive: Build) -> None:
        flat = drive(0.5)
        times = (flat.stamps_ns - flat.stamps_ns[0]) * 1e-9
        rolling = replace(flat, roll=ramp((5, 0), (5.2, 0.5))(times), pitch=np.zeros(times.size))
        assert len(stumble_events(rolling, None, StumbleSettings())) == 1
        assert stumble_events(flat, None, StumbleSettings()) == []
