"""Clouds in other layouts, types and frames: every point stays where it was."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import ManifestError
from graspe_data.recordings.decoding import VelodyneDecoder, decode_image, decode_points
from graspe_data.simulation.habits.carried_clouds import clouds_in_odometry_frame
from graspe_data.simulation.habits.clouds import (
    livox_messages,
    livox_points,
    ouster_points,
    points_of,
    positions_only,
)
from graspe_data.simulation.habits.message_parts import edges_of, pose_of, stamp_of
from graspe_data.simulation.habits.packets import velodyne_packets
from graspe_data.simulation.habits.pictures import Encoding, raw_pictures
from graspe_data.simulation.habits.recorded import (
    Habit,
    Recorded,
    changed,
    left_out,
    with_habits,
)
from graspe_data.synchronisation.transform_buffer import TransformBuffer
from tests.graspe_data.simulation.habits.conftest import IMAGE, ODOMETRY, POINTS, on


def clouds(plain: list[Recorded], *habits: Habit) -> tuple[list[Any], list[Any]]:
    """Before and after."""
    before, after = on(plain, POINTS), on(with_habits(plain, habits), POINTS)
    assert len(before) == len(after) > 3
    return before, after


@pytest.mark.parametrize("habit", [positions_only, ouster_points, livox_points])
def test_another_layout_has_the_same_points(plain: list[Recorded], habit: Any) -> None:
    for truth, told in zip(*clouds(plain, habit(POINTS)), strict=True):
        was, found = decode_points(truth, POINTS), decode_points(told, POINTS)
        np.testing.assert_array_equal(found.xyz, was.xyz)
        assert (found.stamp_ns, found.frame) == (was.stamp_ns, was.frame)
        if habit is positions_only:
            assert (found.intensity, told.point_step) == (None, 12)
        else:
            np.testing.assert_array_equal(found.intensity, was.intensity)


def test_times_and_ranges_of_an_ouster_are_whole_nanoseconds_and_millimetres(
    plain: list[Recorded],
) -> None:
    (truth, *_), (told, *_) = clouds(plain, ouster_points(POINTS))
    fields = {field.name: field.offset for field in told.fields}
    rows = np.asarray(told.data).reshape(-1, told.point_step)
    after_ns = rows[:, fields["t"] :][:, :4].copy().view("<u4").ravel()
    range_mm = rows[:, fields["range"] :][:, :4].copy().view("<u4").ravel()
    points = points_of(truth)
    np.testing.assert_allclose(after_ns, points["time"] * 1e9, atol=8)
    xyz = decode_points(truth, POINTS).xyz
    np.testing.assert_allclose(range_mm, 1000 * np.linalg.norm(xyz, axis=1), atol=0.51)


def test_a_livox_message_says_what_the_cloud_says(plain: list[Recorded]) -> None:
    for truth, told in zip(*clouds(plain, livox_messages(POINTS)), strict=True):
        points = points_of(truth)
        assert told.timebase == stamp_of(told) == stamp_of(truth)
        assert told.point_num == len(told.points) == len(points)
        for axis in "xyz":
            assert [getattr(p, axis) for p in told.points] == points[axis].tolist()
        assert [p.line for p in told.points] == points["ring"].tolist()
        assert [p.reflectivity for p in told.points] == points["intensity"].tolist()
        offsets = [p.offset_time for p in told.points]
        np.testing.assert_allclose(offsets, points["time"] * 1e9, atol=8)


def test_packets_decode_to_the_points_within_what_a_packet_can_say(plain: list[Recorded]) -> None:
    decoder = VelodyneDecoder("VLP-16")
    for truth, told in zip(*clouds(plain, velodyne_packets(POINTS)), strict=True):
        was, found = decode_points(truth, POINTS), decoder.decode(told, POINTS)
        assert len(found.xyz) == len(was.xyz)
        order, new = np.lexsort(_key(was)), np.lexsort(_key(found))
        assert was.ring is not None
        assert found.ring is not None
        np.testing.assert_array_equal(found.ring[new], was.ring[order])
        level = np.linalg.norm((found.xyz[new] - was.xyz[order])[:, :2], axis=1)
        assert level.max() < 0.004
        assert np.abs(found.xyz[new][:, 2] - was.xyz[order][:, 2]).max() < 0.013


def _key(cloud: Any) -> tuple[Any, Any]:
    azimuth = np.mod(np.pi - np.arctan2(cloud.xyz[:, 1], cloud.xyz[:, 0]) + 1e-3, 2 * np.pi)
    return azimuth, cloud.ring


@pytest.mark.parametrize("away", [(0.0, 0.0), (100.0, -70.0)])
def test_clouds_in_the_odometry_frame_come_back_by_the_pose_at_their_stamp(
    plain: list[Recorded], away: tuple[float, float]
) -> None:
    plain = list(with_habits(plain, [changed(ODOMETRY, partial(_begun, away=away))]))
    before, after = clouds(plain, clouds_in_odometry_frame(POINTS, ODOMETRY))
    edges = {(e.parent, e.child): e.transform for e in edges_of(on(plain, "/tf_static")[0])}
    mounted = TransformBuffer.of_fixed(edges).lookup("base_link", "velodyne", 0)
    poses = {stamp_of(message): pose_of(message) for message in on(plain, ODOMETRY)}
    moved = 0.0
    for truth, told in zip(before, after, strict=True):
        assert told.header.frame_id == "odom"
        assert stamp_of(told) == stamp_of(truth)
        was, found = decode_points(truth, POINTS), decode_points(told, POINTS)
        back = (poses[stamp_of(told)] @ mounted).inverse().apply(found.xyz.astype(np.float64))
        assert np.abs(back - was.xyz).max() < 2e-5
        np.testing.assert_array_equal(found.ring, was.ring)
        moved = max(moved, float(np.abs(found.xyz - was.xyz).max()))
    assert moved > 0.5


def _begun(odometry: Any, away: tuple[float, float]) -> Any:
    """Odometry that began elsewhere."""
    pose = odometry.pose.pose
    x, y = pose.position.x + away[0], pose.position.y + away[1]
    moved = replace(pose, position=replace(pose.position, x=x, y=y))
    return replace(odometry, pose=replace(odometry.pose, pose=moved))


def test_carried_clouds_stay_in_their_place_among_the_messages(plain: list[Recorded]) -> None:
    stream = list(with_habits(plain, [clouds_in_odometry_frame(POINTS, ODOMETRY)]))
    assert [(m.topic, m.bag_time_ns) for m in stream] == [(m.topic, m.bag_time_ns) for m in plain]


def test_a_cloud_without_odometry_at_its_stamp_is_refused(plain: list[Recorded]) -> None:
    stamp = stamp_of(on(plain, POINTS)[1])
    gap = [m for m in plain if m.topic != ODOMETRY or stamp_of(m.content) != stamp]
    with pytest.raises(ManifestError, match=f"the cloud at {stamp} ns has no odometry"):
        list(with_habits(gap, [clouds_in_odometry_frame(POINTS, ODOMETRY)]))
    habits = [left_out(ODOMETRY), clouds_in_odometry_frame(POINTS, ODOMETRY)]
    with pytest.raises(ManifestError, match="has no odometry"):
        list(with_habits(plain, habits))


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "mono8"])
def test_raw_pictures_show_the_same(plain: list[Recorded], encoding: Encoding) -> None:
    before = on(plain, IMAGE)
    after = on(with_habits(plain, [raw_pictures(IMAGE, encoding)]), IMAGE)
    for truth, told in zip(before, after, strict=True):
        was = decode_image(truth, "sensor_msgs/msg/CompressedImage", IMAGE)
        found = decode_image(told, "sensor_msgs/msg/Image", IMAGE)
        assert (found.stamp_ns, found.frame) == (was.stamp_ns, was.frame)
        if encoding != "mono8":
            np.testing.assert_array_equal(found.rgb, was.rgb)
        else:
            grey = was.rgb @ np.array([0.299, 0.587, 0.114])
            assert np.abs(found.rgb[..., 0] - grey).max() <= 1.0
