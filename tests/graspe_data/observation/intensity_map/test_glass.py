"""The difference of two layers, and the settings that name them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from graspe_data.errors import ObservationError
from graspe_data.observation.intensity_map.glass import GlassSettings, glass_layer
from tests.graspe_data.observation.intensity_map.test_classes import layers_of


def test_what_stands_in_both_layers_cancels() -> None:
    layers = layers_of(1)
    layers[1] = layers[0]
    assert not glass_layer(layers, GlassSettings()).any()


@given(seed=st.integers(0, 1000))
def test_is_the_difference_cut_off_at_nothing(seed: int) -> None:
    low, middle, high = layers_of(seed)
    found = glass_layer(np.stack((low, middle, high)), GlassSettings())
    for row, column in np.ndindex(found.shape):
        assert found[row, column] == max(middle[row, column] - low[row, column], 0)


def test_a_margin_lets_the_low_layer_count_all_around() -> None:
    layers = np.zeros((2, 9, 9), np.float32)
    layers[0, 4, 4], layers[1, 4, 6], layers[1, 4, 7] = 0.5, 0.4, 0.4
    found = glass_layer(layers, GlassSettings(margin=2))
    assert np.argwhere(found).tolist() == [[4, 7]]


def test_a_layer_that_is_not_there_is_refused() -> None:
    with pytest.raises(ObservationError, match="layers 0 and 1, and the map has 1"):
        glass_layer(np.zeros((1, 4, 4), np.float32), GlassSettings())
    with pytest.raises(ValidationError, match="must differ"):
        GlassSettings(low=1)
