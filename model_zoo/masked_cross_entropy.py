"""The cross-entropy of the steps that a recording can judge."""

from __future__ import annotations

from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits


def masked_cross_entropy(logits: Tensor, target: Tensor, mask: Tensor, weight: Tensor) -> Tensor:
    """The weighted mean binary cross-entropy of the judged steps, a scalar.

    Args:
        logits: (B, T), log-odds of what ``target`` is 1 for.
        target: float32 (B, T), 0 or 1.
        mask: bool (B, T); other steps do not count.
        weight: float32 (B,), of each row.
    """
    every = binary_cross_entropy_with_logits(logits.float(), target, reduction="none")
    counted = mask * weight[:, None]
    return (every * counted).sum() / counted.sum().clamp_min(1e-9)
