from __future__ import annotations

import numpy as np
import torch

from model_zoo.augmentation import AugmentationSettings, augment
from model_zoo.augmentation.draw import draw_lags, late_history
from model_zoo.augmentation.settings import LateHistorySettings


def test_a_late_history_is_what_it_was_so_many_steps_before() -> None:
    history = torch.arange(6.0)[None, :, None].expand(3, 6, 2)
    late = late_history(history, np.array([0, 2, 9]))
    assert late[:, :, 1].tolist() == [
        [0, 1, 2, 3, 4, 5],
        [0, 0, 0, 1, 2, 3],
        [0, 0, 0, 0, 0, 0],
    ]


def test_lags_lie_within_their_limits_and_fall_on_their_share_of_rows() -> None:
    settings = LateHistorySettings(probability=0.3, lag=(2, 5))
    lags = draw_lags(settings, 20_000, np.random.default_rng(0))
    assert set(lags.tolist()) == {0, 2, 3, 4, 5}
    assert abs(np.mean(lags > 0) - 0.3) < 0.02


def test_the_trajectory_image_keeps_the_velocity_at_the_anchor() -> None:
    batch = {
        "velocity_history": torch.rand(64, 10, 2),
        "trajectory_image": torch.zeros(64, 4, 6, dtype=torch.bool),
    }
    settings = AugmentationSettings(mirror=0, late_history=LateHistorySettings(probability=1.0))
    made = augment(batch, settings, seed=0, step=0)
    assert torch.equal(made["trajectory_image"], batch["trajectory_image"])
    assert not torch.equal(made["velocity_history"], batch["velocity_history"])
    unchanged = AugmentationSettings(mirror=0, late_history=LateHistorySettings(probability=0.0))
    kept = augment(batch, unchanged, seed=0, step=0)["velocity_history"]
    assert torch.equal(kept, batch["velocity_history"])
