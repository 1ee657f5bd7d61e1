"""No intensity, another scale, nothing valid: said, never a silent map of zeros."""

from __future__ import annotations

import numpy as np
import pytest

from graspe_data.errors import ObservationError
from graspe_data.observation.intensity_map.strength import declared_strength

EIGHT_BIT = np.arange(200, dtype=np.float32)


@pytest.mark.parametrize("maximum", [1.0, 255.0, 4096.0, 65535.0])
def test_the_declared_scale_is_used(maximum: float) -> None:
    strength = np.linspace(0, maximum, 50).astype(np.float32)
    assert np.array_equal(declared_strength(strength, maximum), strength)


@pytest.mark.parametrize(
    ("strength", "maximum", "fault"),
    [
        (None, 255, "has no intensity"),
        (np.empty(0, np.float32), 255, "has no returns"),
        (np.zeros(9, np.float32), 255, "All 9 intensities are 0"),
        (np.full(9, np.nan, np.float32), 255, "9 of 9 intensities are NaN"),
        (np.full(9, -1, np.float32), 255, "9 of 9 intensities are NaN, infinite or negative"),
        (EIGHT_BIT, 1, r"198 of 200 .* above 1, the strongest 199.*lidar\.intensity_maximum"),
        (EIGHT_BIT * 257, 255, r"above 255, the strongest 51143.*lidar\.intensity_maximum"),
        (EIGHT_BIT / 255, 255, r"strongest .* is 0\.78.*lidar\.intensity_maximum"),
        (EIGHT_BIT, 65535, r"strongest .* is 199.*lidar\.intensity_maximum"),
    ],
)
def test_refused(strength: np.ndarray | None, maximum: float, fault: str) -> None:
    with pytest.raises(ObservationError, match=fault):
        declared_strength(strength, maximum)


def test_one_percent_may_be_above_and_counts_as_the_maximum() -> None:
    strength = np.full(200, 100, np.float32)
    strength[:2] = 300
    assert declared_strength(strength, 255)[:3].tolist() == [255, 255, 100]
    strength[2] = 300
    with pytest.raises(ObservationError, match="3 of 200"):
        declared_strength(strength, 255)


def test_one_percent_may_be_no_numbers_and_counts_as_nothing() -> None:
    strength = np.full(200, 100, np.float32)
    strength[:2] = np.nan, -5
    assert declared_strength(strength, 255)[:3].tolist() == [0, 0, 100]
    strength[2] = np.inf
    with pytest.raises(ObservationError, match="3 of 200"):
        declared_strength(strength, 255)
