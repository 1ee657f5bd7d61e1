"""Tf turned round, split, repeated and added to: the frames stay where they are."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from graspe_data.geometry import Transform
from graspe_data.simulation.habits.message_parts import edges_of, stamp_of
from graspe_data.simulation.habits.recorded import Habit, Recorded, with_habits
from graspe_data.simulation.habits.robots import VISION
from graspe_data.simulation.habits.transforms import (
    fixed_edges_on_tf,
    footprint_hop,
    inverted,
    mounting_in_hops,
    second_odometry,
)
from graspe_data.synchronisation.transform_buffer import TransformBuffer
from tests.graspe_data.simulation.habits.conftest import on


def trees(stream: Iterable[Recorded]) -> dict[int, TransformBuffer]:
    """All edges of each message of /tf, with the fixed ones, by stamp."""
    stream, found = list(stream), {}
    fixed = {
        (e.parent, e.child): e.transform for m in on(stream, "/tf_static") for e in edges_of(m)
    }
    for message in on(stream, "/tf"):
        moving = {(e.parent, e.child): e.transform for e in edges_of(message)}
        found[stamp_of(message.transforms[0])] = TransformBuffer.of_fixed(fixed | moving)
    return found


def assert_same(found: Transform, truth: Transform) -> None:
    np.testing.assert_allclose(found.rotation, truth.rotation, atol=1e-12)
    np.testing.assert_allclose(found.translation, truth.translation, atol=1e-12)


HABITS: dict[str, list[Habit]] = {
    "inverted": [inverted("odom", "base_link")],
    "second odometry": [second_odometry("odom", "base_link", "vision", VISION)],
    "footprint": [footprint_hop("odom", "base_link", "base_footprint")],
    "fixed among moving": [fixed_edges_on_tf()],
    "fixed in both": [fixed_edges_on_tf(latched=True)],
    "hops": [mounting_in_hops("head")],
    "all": [
        mounting_in_hops("head"),
        footprint_hop("odom", "base_link", "base_footprint"),
        fixed_edges_on_tf(),
        inverted("odom", "base_footprint"),
    ],
}


@pytest.mark.parametrize("habits", HABITS.values(), ids=HABITS.keys())
def test_every_frame_stays_where_it_was(plain: list[Recorded], habits: list[Habit]) -> None:
    before, after = trees(plain), trees(with_habits(plain, habits))
    assert before.keys() == after.keys()
    for stamp, tree in before.items():
        for frame in ("base_link", "velodyne", "camera_optical"):
            assert_same(after[stamp].lookup("odom", frame, 0), tree.lookup("odom", frame, 0))


def test_the_inverted_odometry_frame_is_a_child_of_the_body(plain: list[Recorded]) -> None:
    stream = with_habits(plain, [inverted("odom", "base_link")])
    assert {(e.parent, e.child) for m in on(stream, "/tf") for e in edges_of(m)} == {
        ("base_link", "odom")
    }


def test_of_two_odometry_frames_one_is_the_parent_and_one_the_child(plain: list[Recorded]) -> None:
    stream = list(with_habits(plain, HABITS["second odometry"]))
    assert {(e.parent, e.child) for m in on(stream, "/tf") for e in edges_of(m)} == {
        ("odom", "base_link"),
        ("base_link", "vision"),
    }
    for tree in trees(stream).values():
        assert_same(tree.lookup("vision", "odom", 0), VISION)


def test_a_footprint_is_level_and_on_the_ground(plain: list[Recorded]) -> None:
    for tree in trees(with_habits(plain, HABITS["footprint"])).values():
        footprint = tree.lookup("odom", "base_footprint", 0)
        np.testing.assert_allclose(footprint.rotation[2], [0, 0, 1], atol=1e-12)
        assert footprint.translation[2] == 0.0


@pytest.mark.parametrize(("latched", "count"), [(False, 0), (True, 1)])
def test_fixed_edges_come_with_every_message_of_tf(
    plain: list[Recorded], latched: bool, count: int
) -> None:
    stream = list(with_habits(plain, [fixed_edges_on_tf(latched=latched)]))
    assert len(on(stream, "/tf_static")) == count
    assert {len(message.transforms) for message in on(stream, "/tf")} == {3}
