from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding import decode_points

KINDS = {7: "f4", 8: "f8"}


def cloud(build: Any, xyz: Any, order: str, declared: str, datatype: int = 7) -> Any:
    """A cloud with a ring, its bytes in one order and its flag saying another."""
    kind = np.dtype(order + KINDS[datatype])
    size = kind.itemsize
    names = {"x": kind, "y": kind, "z": kind, "ring": np.dtype(order + "u2")}
    points = np.zeros(len(xyz), list(names.items()))
    for axis, values in zip("xyz", np.asarray(xyz).T, strict=True):
        points[axis] = values
    points["ring"] = np.arange(len(xyz)) % 16
    fields = [("x", 0, datatype), ("y", size, datatype), ("z", 2 * size, datatype)]
    fields.append(("ring", 3 * size, 4))
    flag = {"is_bigendian": declared == ">"}
    return build.cloud(fields, points.tobytes(), points.dtype.itemsize, **flag)


NICE = [[8.0, 0.5, -1.0], [10.5, -3.25, 0.0], [2.0, 2.0, 2.0]]
ROUGH = np.random.default_rng(4).normal(0, 12, (300, 3)).astype("f4")


@pytest.mark.parametrize("datatype", KINDS)
@pytest.mark.parametrize("declared", "<>")
@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("xyz", [NICE, ROUGH], ids=["round numbers", "any numbers"])
def test_a_wrong_flag_changes_nothing(
    build: Any, xyz: Any, order: str, declared: str, datatype: int
) -> None:
    found = decode_points(cloud(build, xyz, order, declared, datatype), "/points")
    np.testing.assert_array_equal(found.xyz, np.asarray(xyz, np.float32))
    assert found.ring is not None
    assert found.ring.tolist() == [k % 16 for k in range(len(xyz))]


@pytest.mark.parametrize(("lost", "declared"), [(np.nan, "<"), (np.nan, ">"), (np.inf, "<")])
def test_missing_returns_do_not_vote(build: Any, lost: float, declared: str) -> None:
    xyz = np.zeros((400, 3))
    xyz[::2] = lost
    xyz[::10] = [3.0, 4.0, 0.5]
    found = decode_points(cloud(build, xyz, "<", declared), "/points")
    assert found.xyz.tolist() == [[3.0, 4.0, 0.5]] * 40


@pytest.mark.parametrize("far", [1e30, 5e4, np.float32(3e38)])
def test_ranges_that_no_lidar_has_are_refused(build: Any, far: float) -> None:
    xyz = np.tile([far, 1.0, 1.0], (100, 1))
    with pytest.raises(RecordingError, match="100 lie beyond 1000 m") as refused:
        decode_points(cloud(build, xyz, "<", "<"), "/points")
    assert "/points, header stamp 12.000000034" in str(refused.value)


def test_millimetres_are_named_not_converted(build: Any) -> None:
    with pytest.raises(RecordingError, match=r"millimetres \(the median would be \d+\.\d m\)"):
        decode_points(cloud(build, ROUGH * 1000, "<", "<"), "/points")


def test_a_few_absurd_returns_stay_for_the_range_limit(build: Any) -> None:
    xyz = ROUGH.copy()
    xyz[::10, 0] = 1e30
    assert len(decode_points(cloud(build, xyz, "<", "<"), "/points").xyz) == 300


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 300), st.sampled_from("<>"))
def test_the_true_order_is_found_at_any_scale(
    build_ros2: Any, seed: int, scale: float, declared: str
) -> None:
    xyz = np.random.default_rng(seed).normal(0, scale, (200, 3)).astype("f4")
    found = decode_points(cloud(build_ros2, xyz, "<", declared), "/points")
    np.testing.assert_array_equal(found.xyz, xyz)
