"""One time for all topics."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.robot import Clock
from graspe_data.synchronisation.clocks import ClockSettings, Timeline, camera_timeline, timeline
from graspe_data.synchronisation.tracks import StampTrack

SECOND = 1_000_000_000
BAG = 1_600_000_000 * SECOND + np.arange(200) * (SECOND // 10)
LIMITS = ClockSettings()


def track(topic: str, header: NDArray[np.int64] | None, bag: NDArray[np.int64] = BAG) -> StampTrack:
    return StampTrack(topic, header, bag, np.arange(bag.size))


def aligned(lidar: StampTrack, clock: Clock, camera: StampTrack | None = None) -> Timeline:
    camera = camera or track("/camera", BAG - SECOND // 50)
    return timeline(lidar, clock, camera, camera_timeline(camera, Clock()), LIMITS)


def test_header_stamps_are_the_time_by_default() -> None:
    header = BAG - SECOND // 20
    time = aligned(track("/lidar", header), Clock())
    np.testing.assert_array_equal(time.stamps_ns, header)
    assert (time.offset_ns, time.source) == (0, "header stamp")


def test_a_constant_skew_is_refused_with_the_offset_to_declare() -> None:
    advice = r"/lidar against /camera.*169\.980 s.*offset_s: 169\.980"
    with pytest.raises(RecordingError, match=advice):
        aligned(track("/lidar", BAG - 170 * SECOND), Clock())


def test_a_declared_offset_is_added_and_recorded() -> None:
    time = aligned(track("/lidar", BAG - 170 * SECOND), Clock(offset_s=169.95))
    np.testing.assert_array_equal(time.stamps_ns, BAG - SECOND // 20)
    assert time.offset_ns == round(169.95 * SECOND)


def test_a_measured_offset_makes_the_latencies_equal() -> None:
    time = aligned(track("/lidar", BAG - 170 * SECOND), Clock(offset_s="measured"))
    np.testing.assert_array_equal(time.stamps_ns, BAG - SECOND // 50)


def test_a_drifting_skew_is_unrelated_and_no_offset_is_measured() -> None:
    drifting = BAG - 5 * SECOND - np.arange(200) * (SECOND // 20)
    with pytest.raises(RecordingError, match=r"clocks are unrelated"):
        aligned(track("/lidar", drifting), Clock())
    with pytest.raises(RecordingError, match=r"not constant.*clocks are unrelated"):
        aligned(track("/lidar", drifting), Clock(offset_s="measured"))


def test_clocks_that_drift_together_are_one_clock() -> None:
    drift = 10 * SECOND + np.arange(200) * (SECOND // 30)
    header = BAG + drift - SECOND // 20
    time = aligned(track("/lidar", header), Clock(), track("/camera", BAG + drift))
    np.testing.assert_array_equal(time.stamps_ns, header)


def test_a_topic_without_header_follows_the_camera_across_its_drift() -> None:
    drift = 10 * SECOND + np.arange(200) * (SECOND // 30)
    time = aligned(track("/cmd_vel", None), Clock(), track("/camera", BAG + drift))
    np.testing.assert_allclose(time.stamps_ns, BAG + drift, atol=1)


def test_zero_header_stamps_are_refused() -> None:
    with pytest.raises(RecordingError, match=r"all header stamps are zero.*stamp: bag"):
        aligned(track("/lidar", np.zeros_like(BAG)), Clock())


def test_a_clock_that_jumps_in_the_middle_is_unrelated() -> None:
    header = BAG - SECOND // 20
    header[100:] += 3 * SECOND
    with pytest.raises(RecordingError, match=r"from -2\.\d+ to 0\.\d+ s.*clocks are unrelated"):
        aligned(track("/lidar", header), Clock())


def test_messages_that_the_recorder_got_late_are_no_drift() -> None:
    late = BAG.copy()
    late[50:56] += 2 * SECOND
    header = BAG - SECOND // 20
    time = aligned(track("/lidar", header, late), Clock())
    np.testing.assert_array_equal(time.stamps_ns, header)


def test_a_pause_of_the_camera_does_not_make_clocks_differ() -> None:
    step = np.where(np.arange(200) < 100, 0, 4 * SECOND)
    header = BAG + step
    keep = (np.arange(200) < 80) | (np.arange(200) > 130)
    camera = track("/camera", header[keep], BAG[keep])
    assert aligned(track("/lidar", header), Clock(), camera).offset_ns == 0


def test_a_declared_offset_counts_for_a_topic_without_header() -> None:
    time = aligned(track("/cmd_vel", None), Clock(offset_s=0.5), track("/camera", BAG))
    np.testing.assert_array_equal(time.stamps_ns, BAG + SECOND // 2)
    assert time.offset_ns == SECOND // 2
    with pytest.raises(RecordingError, match=r"measured.*no header stamp"):
        aligned(track("/cmd_vel", None), Clock(offset_s="measured"))
