"""Sectors of the window that are covered."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.simulation.lidar.occlusion import SectorOcclusion

TURN = 2 * np.pi


@settings(deadline=None)
@given(st.floats(-10, 10), st.floats(0.01, 6.2), st.floats(0.001, 0.999), st.integers(-3, 3))
def test_azimuths_between_start_and_stop_are_covered_on_every_turn(
    start: float, width: float, share: float, turns: int
) -> None:
    sector = SectorOcclusion(start, start + width)
    inside = start + share * width + turns * TURN
    outside = start + width + share * (TURN - width) + turns * TURN
    assert sector.covers(np.array([inside, outside])).tolist() == [True, False]


def test_a_whole_turn_covers_everything() -> None:
    assert SectorOcclusion(-np.pi, np.pi).covers(np.linspace(-7, 7, 100)).all()


@pytest.mark.parametrize(("start", "stop"), [(1.0, 1.0), (1.0, 0.5), (0.0, 7.0)])
def test_a_sector_of_no_or_of_too_much_width_is_refused(start: float, stop: float) -> None:
    with pytest.raises(ValueError, match="expected a width above 0 and at most 2 pi"):
        SectorOcclusion(start, stop)
