"""A cloud has one order, ring by ring and each by azimuth, whatever order it came in."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from graspe_data.errors import ObservationError
from graspe_data.observation.ring_order import ring_order
from graspe_data.sensor_data import PointCloud

FEW_VALUES = st.sampled_from([-2.0, -1.0, -0.0, 0.0, 0.5, 1.0, 3.0])


def test_rings_follow_each_other_and_azimuth_grows_within_each(cloud: PointCloud) -> None:
    found = ring_order(cloud.xyz, cloud.ring)
    assert cloud.ring is not None
    ring = cloud.ring[found.order]
    azimuth = np.arctan2(cloud.xyz[found.order, 1], cloud.xyz[found.order, 0])
    assert np.array_equal(np.sort(found.order), np.arange(len(cloud.xyz)))
    assert len(found.ring_starts) == 17
    for number, (start, stop) in enumerate(
        zip(found.ring_starts[:-1], found.ring_starts[1:], strict=True)
    ):
        assert np.all(ring[start:stop] == number)
        assert np.all(np.diff(azimuth[start:stop]) > -1e-5)


@settings(deadline=None)
@given(
    xyz=hnp.arrays(np.float32, st.tuples(st.integers(0, 30), st.just(3)), elements=FEW_VALUES),
    data=st.data(),
)
def test_the_sequence_does_not_depend_on_the_order_of_the_message(
    xyz: NDArray[np.float32], data: st.DataObject
) -> None:
    total = len(xyz)
    ring = data.draw(hnp.arrays(np.uint16, total, elements=st.integers(0, 3)))
    intensity = data.draw(hnp.arrays(np.float32, total, elements=FEW_VALUES))
    shuffle = np.array(data.draw(st.permutations(range(total))), np.int64)
    first = ring_order(xyz, ring, None, intensity)
    second = ring_order(xyz[shuffle], ring[shuffle], None, intensity[shuffle])
    for values in (xyz, ring, intensity):
        there, here = values[first.order], values[shuffle][second.order]
        assert there.tobytes() == here.tobytes()
    assert np.array_equal(first.ring_starts, second.ring_starts)


@pytest.mark.parametrize("rings", [1, 16, 300, 1 << 16])
def test_the_order_is_by_ring_then_azimuth_for_any_number_of_rings(rings: int) -> None:
    generator = np.random.default_rng(rings)
    ring = generator.integers(0, rings, 5000)
    steps = generator.permutation(5000)
    azimuth = (steps + 0.5) * (2 * np.pi / 5000) - np.pi
    xyz = np.column_stack((np.cos(azimuth), np.sin(azimuth), azimuth)).astype(np.float32)
    assert np.array_equal(ring_order(xyz, ring).order, np.lexsort((steps, ring)))


def test_ring_numbers_may_be_any_integers() -> None:
    xyz = np.array([[1, 0, 0], [2, 0, 0], [3, 0, 0]], np.float32)
    found = ring_order(xyz, np.array([2**31 - 1, -5, 70_000], np.int64))
    assert found.order.tolist() == [1, 2, 0]
    assert found.ring_starts.tolist() == [0, 1, 2, 3]


def test_a_field_with_more_values_than_rings_is_refused() -> None:
    total = (1 << 16) + 1
    with pytest.raises(ObservationError, match="65537 different values"):
        ring_order(np.ones((total, 3), np.float32), np.arange(total))


def test_an_empty_cloud_has_no_rings() -> None:
    found = ring_order(np.empty((0, 3), np.float32), None)
    assert len(found.order) == 0
    assert found.ring_starts.tolist() == [0]
