from __future__ import annotations

import numpy as np
import pytest

from model_zoo.augmentation.cover import cover_lens

WHITE = np.ones((240, 320, 3), np.float32)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("seed", range(5))
def test_so_much_of_the_light_is_kept_out(share: float, seed: int) -> None:
    kept = cover_lens(WHITE, share, np.random.default_rng(seed))
    assert abs(1 - kept[..., 0].mean() - share) < 0.04
    assert kept.min() >= 0
    assert kept.max() <= 1 + 1e-6


def test_no_share_covers_nothing_and_a_whole_one_all() -> None:
    assert np.allclose(cover_lens(WHITE, 0.0, np.random.default_rng(0)), WHITE, atol=0.01)
    assert cover_lens(WHITE, 1.0, np.random.default_rng(0)).max() < 0.001


def test_another_generator_covers_other_parts() -> None:
    first, second = (cover_lens(WHITE, 0.5, np.random.default_rng(k)) for k in range(2))
    assert not np.allclose(first, second, atol=0.1)
