"""Which picture, cloud and odometry make a row."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.observation.odometry_series import PoseSeries
from graspe_data.synchronisation.row_plan import (
    RowPlan,
    SynchronisationSettings,
    choose_anchors,
    pair_nearest,
    plan_rows,
)

MS = 1_000_000
SECOND = 1000 * MS
SETTINGS = SynchronisationSettings(
    anchor_rate=10, history_steps=5, history_step_s=0.1, horizon_s=1.0, points_tolerance_s=0.05
)


def stamps(start_s: float, stop_s: float, rate: float) -> NDArray[np.int64]:
    count = round((stop_s - start_s) * rate) + 1
    return np.rint((start_s + np.arange(count) / rate) * SECOND).astype(np.int64)


def odometry(stamps_ns: NDArray[np.int64]) -> PoseSeries:
    seconds = stamps_ns / SECOND
    pose = np.zeros((stamps_ns.size, 6))
    pose[:, 0], pose[:, 5] = seconds, 0.1 * seconds
    return PoseSeries(stamps_ns, pose, np.stack([seconds, 0 * seconds], axis=1))


def plan(image: NDArray[np.int64], points: NDArray[np.int64], motion: NDArray[np.int64]) -> RowPlan:
    return plan_rows(image, points, odometry(motion), SETTINGS)


@given(
    st.lists(st.integers(0, 1000), min_size=1, max_size=30),
    st.lists(st.integers(0, 1000), min_size=1, max_size=30),
    st.integers(0, 200),
)
def test_the_nearest_is_the_nearest_and_of_two_the_older(
    ours: list[int], theirs: list[int], tolerance: int
) -> None:
    found = pair_nearest(np.array(ours), np.array(theirs), tolerance / SECOND)
    for stamp, index in zip(ours, found.tolist(), strict=True):
        distance = min(abs(stamp - other) for other in theirs)
        if distance > tolerance:
            assert index == -1
        else:
            best = [other for other in theirs if abs(stamp - other) == distance]
            assert theirs[index] == min(best)


@pytest.mark.parametrize(("rate", "expected"), [(10, 11), (5, 6), (30, 31), (1, 2)])
def test_anchors_keep_the_rate(rate: float, expected: int) -> None:
    assert choose_anchors(stamps(0, 1, 30), rate).size == expected


@pytest.mark.parametrize("camera", [10, 11, 12, 14, 15, 25, 29.97, 30, 60])
def test_the_rate_holds_whatever_the_camera_s(camera: float) -> None:
    generator = np.random.default_rng(0)
    jittered = stamps(0, 60, camera) + generator.integers(-1, 2, round(60 * camera) + 1) * MS
    assert choose_anchors(jittered, 10).size == pytest.approx(600, abs=6)


def test_jitter_does_not_halve_the_rate() -> None:
    jittered = stamps(0, 60, 30) + np.random.default_rng(0).integers(-8, 8, 1801) * MS
    assert choose_anchors(jittered, 10).size == pytest.approx(601, abs=15)


def test_anchors_come_in_time_order_and_once_a_stamp() -> None:
    shuffled = np.array([300, 100, 200, 100, 0]) * MS
    assert (shuffled[choose_anchors(shuffled, 10)] == np.array([0, 100, 200, 300]) * MS).all()


def test_every_anchor_is_a_row_or_counted_under_a_reason() -> None:
    image, points, motion = stamps(0, 5, 10), stamps(0, 5, 10), stamps(0, 5, 50)
    made = plan(image, points, motion)
    assert made.lost == {
        "history begins before the odometry": 4,
        "horizon runs past the end of the odometry": 10,
    }
    assert made.rows + sum(made.lost.values()) == image.size


def test_history_is_oldest_first_and_ends_at_the_anchor() -> None:
    made = plan(stamps(0, 5, 10), stamps(0, 5, 10), stamps(0, 5, 50))
    back = np.array([0.4, 0.3, 0.2, 0.1, 0.0])
    expected = made.anchor_ns[:, None] / SECOND - back
    np.testing.assert_allclose(made.history[..., 0], expected, atol=1e-6)
    np.testing.assert_array_equal(made.history[:, -1], made.now.velocity.astype(np.float32))


def test_a_gap_in_the_odometry_makes_no_row_whose_history_it_touches() -> None:
    motion = stamps(0, 8, 50)
    motion = motion[(motion <= 3 * SECOND) | (motion >= 4 * SECOND)]
    made = plan(stamps(0, 8, 10), stamps(0, 8, 10), motion)
    assert made.lost["gap in the odometry of the history"] == 13
    late = (made.anchor_ns > 3 * SECOND) & (made.anchor_ns - 400 * MS < 4 * SECOND)
    assert not late.any()


def test_without_a_cloud_within_the_tolerance_there_is_no_row() -> None:
    made = plan(stamps(0, 5, 10), stamps(0, 5, 5), stamps(0, 5, 50))
    assert made.lost["no cloud within the tolerance"] == 18
    assert (made.points_age_ns == 0).all()


def test_a_row_without_a_cloud_is_kept_and_marked_where_clouds_are_not_required() -> None:
    settings = SETTINGS.model_copy(update={"points_required": False})
    made = plan_rows(stamps(0, 5, 10), stamps(0, 5, 5), odometry(stamps(0, 5, 50)), settings)
    assert "no cloud within the tolerance" not in made.lost
    assert np.count_nonzero(made.points < 0) == 18


def test_age_is_positive_for_a_cloud_older_than_the_picture() -> None:
    made = plan(stamps(0, 5, 10), stamps(0, 5, 10) - 30 * MS, stamps(0, 5, 50))
    assert (made.points_age_ns == 30 * MS).all()


@given(st.permutations(range(40)))
def test_the_order_of_messages_does_not_matter(order: list[int]) -> None:
    image, points, motion = stamps(0, 3.9, 10), stamps(0, 3.9, 10), stamps(0, 4, 50)
    straight = plan(image, points, motion)
    mixed = plan(image[order], points[order], motion)
    np.testing.assert_array_equal(mixed.anchor_ns, straight.anchor_ns)
    np.testing.assert_array_equal(image[order][mixed.image], image[straight.image])
    np.testing.assert_array_equal(points[order][mixed.points], points[straight.points])
