"""Blobs on the lens cover the share that they are told to."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.simulation.camera.lens_cover import LensCover, cover_lens, covered_share

SCENE = np.full((240, 320, 3), 1000.0, np.float32)


@given(st.floats(0, 1), st.integers(0, 2**31 - 1))
def test_the_mean_share_is_the_one_asked_for(share: float, seed: int) -> None:
    mask = covered_share(LensCover(share, seed), 240, 320)
    assert mask.mean() == pytest.approx(share, abs=2e-3)
    assert mask.min() >= 0.0
    assert mask.max() <= 1.0


def test_nothing_so_near_the_lens_has_an_edge() -> None:
    mask = covered_share(LensCover(0.5, 3), 240, 320)
    assert np.abs(np.diff(mask, axis=1)).max() < 0.1
    assert np.mean(mask > 0.95) > 0.2
    assert np.mean(mask < 0.05) > 0.2


def test_the_seed_gives_the_shape() -> None:
    first, again, other = (covered_share(LensCover(0.4, seed), 60, 80) for seed in (1, 1, 2))
    assert first.tobytes() == again.tobytes()
    assert np.abs(first - other).max() > 0.5


def test_a_wholly_covered_lens_lets_next_to_nothing_through() -> None:
    cover = LensCover(1.0, 5)
    left = cover_lens(SCENE, cover, covered_share(cover, 240, 320))
    assert 0.0 < left.max() < 2e-4 * 1000.0


def test_the_uncovered_part_is_as_bright_as_before_and_the_rest_dark_green_or_brown() -> None:
    cover = LensCover(0.5, 5)
    mask = covered_share(cover, 240, 320)
    left = cover_lens(SCENE, cover, mask)
    assert left[mask == 0.0] == pytest.approx(1000.0)
    dark = left[mask == 1.0]
    assert dark.max() < 50.0
    assert (dark[:, 2] < dark[:, :2].max(axis=1)).all()


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_a_share_that_is_none_is_refused(share: float) -> None:
    with pytest.raises(ValueError, match=r"is not in 0\.\.1"):
        LensCover(share)
