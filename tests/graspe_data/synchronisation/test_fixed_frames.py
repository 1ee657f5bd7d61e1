"""Fixed frames: paths over any number of edges, and what is said where there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from graspe_data.errors import GeometryError
from graspe_data.geometry import Transform
from graspe_data.synchronisation.transform_buffer import TransformBuffer

HALF = np.sqrt(0.5)


def same(found: Any, expected: Any) -> None:
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.fixture
def frames() -> TransformBuffer:
    """map > odom > base_link > mast > (camera, lidar), and a frame on an island."""
    quarter = np.array([0, 0, HALF, HALF])
    return TransformBuffer.of_fixed(
        {
            ("map", "odom"): Transform(np.eye(3), np.array([100.0, 0, 0])),
            ("/odom", "base_link"): Transform.from_quaternion(np.array([1.0, 0, 0]), quarter),
            ("base_link", "/mast"): Transform(np.eye(3), np.array([0, 0, 1.0])),
            ("mast", "camera"): Transform.from_quaternion(np.array([0.5, 0, 0]), quarter),
            ("mast", "lidar"): Transform(np.eye(3), np.array([0, 0, 0.25])),
            ("island", "palm"): Transform.identity(),
        }
    )


@pytest.mark.parametrize(
    ("target", "source", "image_of_the_origin"),
    [
        ("base_link", "base_link", (0, 0, 0)),
        ("base_link", "camera", (0.5, 0, 1)),
        ("camera", "base_link", (0, 0.5, -1)),
        ("lidar", "camera", (0.5, 0, -0.25)),
        ("odom", "camera", (1, 0.5, 1)),
        ("/map", "/lidar", (101, 0, 1.25)),
    ],
)
def test_frames_are_looked_up_over_any_number_of_edges(
    frames: TransformBuffer, target: str, source: str, image_of_the_origin: tuple[float, ...]
) -> None:
    found = frames.lookup(target, source, 0)
    same(found.apply(np.zeros(3)), image_of_the_origin)


def test_there_and_back_is_nothing(frames: TransformBuffer) -> None:
    both = frames.lookup("map", "camera", 0) @ frames.lookup("camera", "map", 0)
    same(both.rotation, np.eye(3))
    same(both.translation, np.zeros(3))


def test_a_loop_is_cut_short() -> None:
    step = Transform(np.eye(3), np.array([1.0, 0, 0]))
    around = {("a", "b"): step, ("b", "c"): step, ("c", "d"): step, ("d", "a"): step}
    np.testing.assert_array_equal(
        TransformBuffer.of_fixed(around).lookup("a", "d", 0).translation, [-1, 0, 0]
    )


@pytest.mark.parametrize("source", ["laser", "palm"])
def test_frames_that_do_not_connect_are_named_with_those_that_are_known(
    frames: TransformBuffer, source: str
) -> None:
    with pytest.raises(GeometryError) as caught:
        frames.lookup("base_link", source, 0)
    text = str(caught.value)
    assert f"No transform from '{source}' to 'base_link'" in text
    assert "base_link, camera, island, lidar, map, mast, odom, palm" in text
    assert "robot manifest" in text


def test_without_frames_there_is_only_the_way_to_oneself() -> None:
    empty = TransformBuffer.of_fixed({})
    assert empty.frames == []
    np.testing.assert_array_equal(empty.lookup("a", "/a", 0).rotation, np.eye(3))
    with pytest.raises(GeometryError, match="tf: none"):
        empty.lookup("a", "b", 0)
