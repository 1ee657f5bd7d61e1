from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from model_zoo.point_scale import bounded


@settings(deadline=None)
@given(st.floats(0.01, 1000), st.floats(0.1, 20))
def test_directions_stay_and_lengths_are_bounded(length: float, half_range: float) -> None:
    direction = torch.tensor([2.0, -1.0, 2.0]) / 3
    scaled = bounded(direction * length, half_range)
    torch.testing.assert_close(scaled / scaled.norm(), direction)
    assert scaled.norm().item() == pytest.approx(length / (half_range + length), rel=1e-4)
    assert scaled.norm() < 1


def test_at_half_range_a_length_is_a_half_and_the_origin_stays() -> None:
    scaled = bounded(torch.tensor([[3.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), 3.0)
    torch.testing.assert_close(scaled, torch.tensor([[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]]))
