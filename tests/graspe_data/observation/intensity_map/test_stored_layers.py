"""Layers as bytes."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.observation.intensity_map.grid import restore_layers, store_layers


def test_an_8_bit_lidar_loses_nothing() -> None:
    values = np.arange(256)
    shares = (values / 255).astype(np.float32)
    assert np.array_equal(store_layers(shares), values)
    assert np.array_equal(restore_layers(store_layers(shares)), shares)


@given(st.integers(1, 65535))
def test_no_cell_with_a_return_becomes_empty_and_none_gets_weaker(strength: int) -> None:
    value = strength / 65535
    kept = float(restore_layers(store_layers(np.array([value], np.float32)))[0])
    assert value - 1e-5 <= kept <= value + 1 / 255
    assert kept > 0
