"""Velocity histories that end before the anchor."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from model_zoo.augmentation.settings import LateHistorySettings


def late_history(history: Tensor, lag: NDArray[np.int64]) -> Tensor:
    """Histories (B, H, 2), oldest first, as they were so many steps before; the oldest is held.

    Args:
        history: m/s and rad/s.
        lag: Steps of the history, (B,); 0 changes nothing.
    """
    steps = torch.arange(history.shape[1])[None] - torch.from_numpy(lag)[:, None]
    return history.gather(1, steps.clamp(min=0)[:, :, None].expand(-1, -1, history.shape[2]))


def draw_lags(
    settings: LateHistorySettings, number: int, generator: np.random.Generator
) -> NDArray[np.int64]:
    """Steps that each of so many rows is late by, (number,); 0 for rows that are not."""
    late = generator.random(number) < settings.probability
    shortest, longest = settings.lag
    return np.where(late, generator.integers(shortest, longest, number, endpoint=True), 0)
