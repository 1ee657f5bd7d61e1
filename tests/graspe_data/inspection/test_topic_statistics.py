from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from graspe_data.inspection.pairing import pair_topics
from graspe_data.inspection.topic_statistics import topic_statistics
from graspe_data.synchronisation.tracks import StampTrack

START = 1_700_000_000_000_000_000
SECOND = 1_000_000_000


def track(seconds: ArrayLike, skew: ArrayLike = 0.0, topic: str = "/topic") -> StampTrack:
    """Stamps at some seconds, received so much later."""
    header = START + np.rint(np.asarray(seconds, np.float64) * SECOND).astype(np.int64)
    late = np.rint(np.broadcast_to(skew, header.shape) * SECOND).astype(np.int64)
    return StampTrack(topic, header, header + late, np.arange(header.size))


def test_an_even_topic_has_its_rate_and_no_fault() -> None:
    found = topic_statistics(track(np.arange(100) / 10, 0.02), START)
    assert found is not None
    assert found.rate_hz == pytest.approx(10.0)
    assert found.duration_s == pytest.approx(9.9)
    assert found.gaps is None
    assert (found.out_of_order, found.repeated, found.zero_stamps) == (0, 0, 0)
    assert found.skew is not None
    assert found.skew.median_s == pytest.approx(0.02)
    assert found.skew.drift_s == pytest.approx(0.0, abs=1e-9)


def test_a_silence_is_a_gap_with_its_length_and_place() -> None:
    seconds = [*np.arange(20) / 10, *(5.0 + np.arange(20) / 10), *(7.4 + np.arange(5) / 10)]
    found = topic_statistics(track(seconds), START)
    assert found is not None
    assert found.gaps is not None
    assert found.gaps.number == 2
    assert found.gaps.longest_s == pytest.approx(3.1)
    assert found.gaps.at_s == pytest.approx(1.9)


def test_a_fast_topic_has_no_gap_below_a_fifth_of_a_second() -> None:
    found = topic_statistics(track([*np.arange(100) / 400, *(0.4 + np.arange(100) / 400)]), START)
    assert found is not None
    assert found.gaps is None


@given(rate=st.floats(-0.01, 0.01), base=st.floats(-1e6, 1e6))
def test_drift_is_what_the_skew_gains_over_the_recording(rate: float, base: float) -> None:
    seconds = np.arange(200) / 10
    found = topic_statistics(track(seconds, base + rate * seconds), START)
    assert found is not None
    assert found.skew is not None
    assert found.skew.drift_s == pytest.approx(rate * seconds[-1], abs=1e-6)


def test_disorder_repeats_and_zeros_are_counted_and_zeros_leave_the_skew_alone() -> None:
    own = track([0.0, 0.1, 0.1, 0.3, 0.2, 0.4], 0.01)
    assert own.header_ns is not None
    own.header_ns[-1] = 0
    found = topic_statistics(own, START)
    assert found is not None
    assert (found.out_of_order, found.repeated, found.zero_stamps) == (1, 1, 1)
    assert found.skew is not None
    assert found.skew.maximum_s == pytest.approx(0.01)


def test_without_stamps_bag_time_counts_and_there_is_no_skew() -> None:
    bare = track(np.arange(10) / 5)
    found = topic_statistics(StampTrack("/cmd", None, bare.bag_ns, bare.ordinal), START)
    assert found is not None
    assert (found.clock, found.skew) == ("bag", None)
    assert found.rate_hz == pytest.approx(5.0)


def test_a_topic_without_messages_has_no_statistics() -> None:
    assert topic_statistics(track([]), START) is None


def test_pairs_are_counted_by_either_clock() -> None:
    sensor = track(np.arange(50) / 10, 0.03, "/scan")
    late = np.where(np.arange(50) < 20, 0.03, 0.5)
    odometry = track(np.arange(50) / 10, late, "/odom")
    found = pair_topics(sensor, odometry)
    assert (found.messages, found.by_header) == (50, 50)
    assert found.by_bag < 50


def test_clocks_apart_give_no_pair_and_the_skew_as_reason() -> None:
    sensor = track(np.arange(5) / 10, 20_543_620.0, "/cloud")
    odometry = track(np.arange(5) / 10 - 1e8, 20_543_620.0 + 1e8 + 7.0, "/odom")
    found = pair_topics(sensor, odometry)
    assert (found.by_header, found.by_bag) == (0, 0)
    assert found.reason is not None
    assert "/odom against /cloud" in found.reason
    assert "100000007.000 s" in found.reason
    assert "/cloud ends 6.600 s before /odom begins" in found.reason


def test_topics_that_follow_each_other_say_so() -> None:
    found = pair_topics(track([0.0, 0.1], 0.0, "/scan"), track([9.0, 9.1], 0.0, "/odom"))
    assert found.by_header == 0
    assert found.reason is not None
    assert "/scan ends 8.900 s before /odom begins" in found.reason
