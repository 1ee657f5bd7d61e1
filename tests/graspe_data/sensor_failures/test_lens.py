"""The sun in the lens and drops on it: nothing at 0, ever more, the same each time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.sensor_failures import Droplets, Glare, add_glare, through_droplets

SEEDS = st.integers(0, 2**31)


def scene(height: int = 60, width: int = 80) -> NDArray[np.float32]:
    """Stripes of dark and light, 1 to 9."""
    bright = 1 + 8 * (np.arange(width) // 5 % 2)
    return np.broadcast_to(bright[None, :, None], (height, width, 3)).astype(np.float32)


def contrast(light: NDArray[np.float32]) -> float:
    """Of neighbouring columns in the lower half, relative to the light there."""
    low = light[light.shape[0] // 2 :].mean(axis=2)
    return float(np.abs(np.diff(low, axis=1)).mean() / low.mean())


def test_nothing_happens_at_0() -> None:
    light = scene()
    assert add_glare(light, Glare(0.0)) is light
    assert through_droplets(light, Droplets(0.0)) is light


@settings(max_examples=30)
@given(SEEDS, st.floats(0.05, 1))
def test_a_glare_adds_light_everywhere_and_takes_contrast(seed: int, strength: float) -> None:
    light = scene()
    dazzled = add_glare(light, Glare(strength, seed))
    added = dazzled - light
    assert added.min() > strength * light.mean()
    assert added.max() > 2 * added.min()
    assert contrast(dazzled) < contrast(light)
    np.testing.assert_array_equal(dazzled, add_glare(light, Glare(strength, seed)))


def test_a_stronger_glare_takes_more_contrast_until_little_is_left() -> None:
    left = [contrast(add_glare(scene(), Glare(s, 3))) for s in (0.1, 0.3, 0.6, 1.0)]
    assert left == sorted(left, reverse=True)
    assert left[-1] < 0.5 * contrast(scene())


def test_the_sun_stands_in_the_upper_part() -> None:
    flat = np.ones((60, 80, 3), np.float32)
    for seed in range(20):
        added = add_glare(flat, Glare(1.0, seed)).mean(axis=2)
        row, _ = np.unravel_index(int(added.argmax()), added.shape)
        assert row <= 0.25 * 60 + 1


@settings(max_examples=20, deadline=None)
@given(SEEDS, st.floats(0.05, 0.8))
def test_drops_cover_the_share_asked_for_and_leave_the_rest(seed: int, share: float) -> None:
    light = np.random.default_rng(0).uniform(1, 9, (60, 80, 3)).astype(np.float32)
    wet = through_droplets(light, Droplets(share, seed))
    changed = (wet != light).any(axis=2).mean()
    # A drop more than the share at most; rims count in part.
    assert share * 0.95 <= changed <= share * 2.2 + 0.03
    assert wet.min() >= 0
    np.testing.assert_array_equal(wet, through_droplets(light, Droplets(share, seed)))


def test_a_drop_shows_the_scene_upside_down() -> None:
    above = np.zeros((240, 320, 3), np.float32)
    above[:120] = 1.0
    wet = through_droplets(above, Droplets(0.4, 5)).mean(axis=2)
    dry = above.mean(axis=2)
    assert (wet[130:] > 0.3).mean() > 0.05, "bright sky shows below the horizon"
    assert ((wet < 0.3) & (dry == 1))[:110].mean() > 0.02, "dark ground shows above it"


@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan")])
def test_a_share_that_is_none_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match=r"is not in 0\.\.1"):
        Glare(value)
    with pytest.raises(ValueError, match=r"is not in 0\.\.1"):
        Droplets(value)
