"""The velocity history of a situation: at the picture's moment, never made up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from graspe_data.calibration import Calibration
from graspe_data.errors import ObservationError, PlannerError
from graspe_data.observation.settings import ObservationSettings
from graspe_data.robot import Robot
from graspe_data.sensor_data import Motion
from planners.motion_history import motion_history
from tests.planners.conftest import NOW, Situations
from tests.planners.tiny_bundle import HISTORY, tiny_contract


@pytest.fixture
def settings(robot: Robot, calibration: Calibration) -> ObservationSettings:
    return tiny_contract(robot, calibration).observation


def _motions(*samples: tuple[float, float | None]) -> tuple[Motion, ...]:
    return tuple(
        Motion(NOW + round(s * 1e9), "odom", "base", None, None, v, None if v is None else -v)
        for s, v in samples
    )


def test_samples_are_interpolated_oldest_first(
    situation: Situations, settings: ObservationSettings
) -> None:
    motions = _motions(*((0.05 * step, 5 + 0.05 * step) for step in range(-60, 1)))
    history = motion_history(replace(situation(), motions=motions), NOW - 10**8, settings)
    expected = 5 - 0.1 - 0.1 * np.arange(HISTORY - 1, -1, -1)
    assert history.dtype == np.float32
    assert history[:, 0] == pytest.approx(expected)
    assert history[:, 1] == pytest.approx(-expected)


def test_the_order_of_the_motions_does_not_matter(
    situation: Situations, settings: ObservationSettings
) -> None:
    moment = situation()
    turned = replace(moment, motions=moment.motions[::-1])
    found = [motion_history(each, NOW, settings) for each in (moment, turned)]
    assert np.array_equal(found[0], found[1])


def test_the_velocity_of_now_stands_after_the_latest_motion(
    situation: Situations, settings: ObservationSettings
) -> None:
    motions = _motions(*((0.05 * step, 0.0) for step in range(-60, -2)))
    moment = replace(situation(velocity=(0.4, 0.1)), motions=motions)
    history = motion_history(moment, NOW, settings)
    assert history[-1] == pytest.approx((0.4, 0.1))
    assert history[-3] == pytest.approx((0.0, 0.0))


@pytest.mark.parametrize("span", [(-20, 1), (-60, -8)])
def test_motions_that_do_not_cover_the_history(
    situation: Situations, settings: ObservationSettings, span: tuple[int, int]
) -> None:
    motions = _motions(*((0.05 * step, 0.0) for step in range(*span)))
    with pytest.raises(PlannerError, match=r"the velocity history needs -1\.90 s to 0"):
        motion_history(replace(situation(), motions=motions), NOW, settings)


def test_a_gap_is_not_bridged(situation: Situations, settings: ObservationSettings) -> None:
    steps = [step for step in range(-60, 1) if not -20 < step < -10]
    motions = _motions(*((0.05 * step, 0.0) for step in steps))
    with pytest.raises(PlannerError, match="without a gap longer than"):
        motion_history(replace(situation(), motions=motions), NOW, settings)


@pytest.mark.parametrize("motions", [(), _motions((-1.0, 0.0)), _motions((-1.0, None), (0, None))])
def test_too_few_motions(
    situation: Situations, settings: ObservationSettings, motions: tuple[Motion, ...]
) -> None:
    with pytest.raises(ObservationError, match="usable odometry samples"):
        motion_history(replace(situation(), motions=motions), NOW - 10**9, settings)
