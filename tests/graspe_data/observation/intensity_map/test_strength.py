"""No intensity, another scale, nothing valid: said, never a silent map of zeros."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.errors import ObservationError
from graspe_data.observation.intensity_map.strength import IntensityScale

EIGHT_BIT = np.arange(200, dtype=np.float32)


def declared_strength(intensity: np.ndarray | None, maximum: float) -> np.ndarray:
    """What is made of the first cloud of a lidar."""
    return IntensityScale(maximum).strength(intensity)


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
        (EIGHT_BIT / 255, 255, r"within 0 to 0\.9.*smaller scale.*lidar\.intensity_maximum"),
        (EIGHT_BIT, 65535, r"within 0 to .*expected 0 to 65535.*lidar\.intensity_maximum"),
    ],
)
def test_refused(strength: np.ndarray | None, maximum: float, fault: str) -> None:
    with pytest.raises(ObservationError, match=fault):
        declared_strength(strength, maximum)


def test_one_percent_may_be_above_and_counts_as_the_maximum() -> None:
    strength = np.full(200, 120, np.float32)
    strength[:2] = 300
    assert declared_strength(strength, 255)[:3].tolist() == [255, 255, 120]
    strength[2] = 300
    with pytest.raises(ObservationError, match="3 of 200"):
        declared_strength(strength, 255)


def test_one_percent_may_be_no_numbers_and_counts_as_nothing() -> None:
    strength = np.full(200, 120, np.float32)
    strength[:2] = np.nan, -5
    assert declared_strength(strength, 255)[:3].tolist() == [0, 0, 120]
    strength[2] = np.inf
    with pytest.raises(ObservationError, match="3 of 200"):
        declared_strength(strength, 255)


def cloud(scale: float, seed: int = 0, number: int = 20_000) -> np.ndarray:
    """Ground that returns little, grass, and a tenth of something solid; whole counts of 255."""
    drawn = np.random.default_rng(seed)
    kinds = drawn.choice([30.0, 90.0, 200.0], number, p=[0.6, 0.3, 0.1])
    counts = np.rint(np.clip(drawn.normal(kinds, kinds / 10), 0, 255))
    return (counts * (scale / 255)).astype(np.float32)


def velodyne(seed: int, reflectors: int) -> np.ndarray:
    """As a VLP-16 gives it: what sends no beam back is 0..100, and whatever is white is 100."""
    drawn = np.random.default_rng(seed)
    counts = np.rint(np.minimum(drawn.exponential(45, 15_000), 100))
    counts[:reflectors] = np.roll([103, 106, 109, 112, 119, 121], 2 * seed)[:reflectors]
    return counts.astype(np.float32)


@pytest.mark.parametrize("strays", [0, 1, 3, 20, 200])
@pytest.mark.parametrize(("scale", "maximum"), [(1, 255), (1, 100), (100, 255), (255, 4096)])
def test_a_few_saturated_returns_do_not_make_another_scale_the_declared_one(
    scale: float, maximum: float, strays: int
) -> None:
    strength = cloud(scale)
    strength[:strays] = maximum
    with pytest.raises(ObservationError, match=r"lidar\.intensity_maximum"):
        declared_strength(strength, maximum)
    assert declared_strength(cloud(maximum), maximum).max() <= maximum


@settings(deadline=None, max_examples=50)
@given(
    factor=st.floats(0.001, 0.25),
    seed=st.integers(0, 100),
    strays=st.lists(st.floats(0, 255), max_size=200),
    maximum=st.sampled_from([1.0, 100.0, 255.0, 65535.0]),
)
def test_whatever_the_strays_a_scale_that_is_far_off_is_refused(
    factor: float, seed: int, strays: list[float], maximum: float
) -> None:
    strength = cloud(maximum * factor, seed)
    strength[: len(strays)] = np.float32(maximum / 255) * np.array(strays, np.float32)
    with pytest.raises(ObservationError, match="smaller scale"):
        declared_strength(strength, maximum)


def test_a_velodyne_is_told_from_percent_by_its_reflectors() -> None:
    assert declared_strength(velodyne(0, 6), 255).max() > 100
    for percent in (velodyne(0, 0), velodyne(0, 2)):
        with pytest.raises(ObservationError, match="cannot be told"):
            declared_strength(percent, 255)
        assert declared_strength(percent, 100).max() == 100


def test_the_first_clouds_together_tell_and_later_ones_are_held_to_it() -> None:
    scale = IntensityScale(255)
    for seed in range(2):
        with pytest.raises(ObservationError, match="cannot be told"):
            scale.strength(velodyne(seed, 2))
    assert scale.strength(velodyne(2, 3)).max() > 100
    assert scale.strength(velodyne(3, 0)).max() == 100
    for changed in (velodyne(4, 0) / 255, velodyne(4, 0) / 100, velodyne(4, 0) * (100 / 255)):
        with pytest.raises(ObservationError, match="scale has changed"):
            scale.strength(changed.astype(np.float32))
    assert scale.strength(velodyne(5, 0)).max() == 100


def test_what_gets_duller_by_and_by_is_seen_and_a_sudden_change_is_not() -> None:
    scale = IntensityScale(255)
    with pytest.raises(ObservationError, match="smaller scale"):
        declared_strength(np.rint(cloud(70)), 255)
    scale.strength(cloud(255))
    for factor in (100, 70):
        with pytest.raises(ObservationError, match="scale has changed"):
            scale.strength(np.rint(cloud(factor)))
    for factor in (200, 150, 100, 75):
        dull = np.rint(cloud(factor))
        assert np.array_equal(scale.strength(dull), dull)
    assert scale.strength(cloud(255)).max() > 200
