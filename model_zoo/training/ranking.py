"""What tells the trajectories in one scene apart: a loss over pairs of them."""

from __future__ import annotations

from torch import Tensor
from torch.nn.functional import softplus


def ranking_loss(logits: Tensor, success: Tensor, mask: Tensor, scenes: int) -> Tensor:
    """The mean of log(1 + exp(fails - succeeds)) over pairs of which one fails, a scalar.

    A pair is two trajectories in the same scene at the same step, both judged, of which one
    succeeds: the loss is the cross-entropy of telling which (Burges et al., RankNet, ICML 2005).
    The cross-entropy of each alone is mostly about how hard the scene is; here that cancels.

    Args:
        logits: (B n, T), log-odds of success, scene by scene.
        success: float32 (B n, T), 1 = success.
        mask: bool (B n, T), whether the step is judged.
        scenes: B.

    Returns:
        0 where there is no pair.
    """
    number, steps = len(logits) // scenes, logits.shape[1]
    by_scene = (scenes, number, steps)
    odds, judged = logits.float().view(by_scene), mask.view(by_scene)
    succeeds = judged & (success.view(by_scene) > 0)
    fails = judged & (success.view(by_scene) == 0)
    pairs = succeeds[:, :, None] & fails[:, None, :]
    apart = softplus(odds[:, None, :] - odds[:, :, None])
    return (apart * pairs).sum() / pairs.sum().clamp_min(1)
