"""The maximum over points of a linear layer and its batch normalisation, in training."""

from __future__ import annotations

import torch
from torch import Tensor, nn


def normalised_maximum(x: Tensor, linear: nn.Linear, norm: nn.BatchNorm2d) -> Tensor:
    """``norm(linear(x)).max(1).values`` of x (B, N, C) in training mode, (B, outputs) in float32.

    The normalisation rises or falls with its input, so the extreme of the linear layer is enough,
    and its statistics follow from those of x:

        mean(W x + b) = W mean(x) + b,  var(W x + b) = diag(W cov(x) W^T)

    Values (B, N, outputs) are looked at once, to find the extremes; none is kept for the backward
    pass, which goes through B times outputs points. The running statistics move as ``norm``'s do.
    """
    device = x.device.type
    chosen = _extreme_points(x, linear, norm)
    with torch.autocast(device, enabled=False):
        weight = linear.weight.float()
        mean, covariance = _moments(x.float())
        centred = torch.einsum("bok,ok->bo", _gather(x.float(), chosen) - mean, weight)
        variance = torch.einsum("ok,kj,oj->o", weight, covariance, weight)
        _move_statistics(norm, weight @ mean + linear.bias, variance, x.shape[0] * x.shape[1])
        scale = norm.weight * torch.rsqrt(variance + norm.eps)
        # The linear layer's bias cancels; it stays in the graph, where DDP looks for it.
        return centred * scale + (norm.bias + 0.0 * linear.bias)


@torch.no_grad()
def _extreme_points(x: Tensor, linear: nn.Linear, norm: nn.BatchNorm2d) -> Tensor:
    """Which point is the largest after the normalisation: indices (B, outputs)."""
    signed = linear.weight * torch.where(norm.weight < 0, -1.0, 1.0)[:, None]
    values = signed @ x.mT
    if values.device.type == "cpu":
        # NumPy's argmax is vectorised; torch's takes ten times as long.
        return torch.from_numpy(values.float().numpy().argmax(2))
    return values.argmax(2)


def _moments(x: Tensor) -> tuple[Tensor, Tensor]:
    """The mean (C,) over all points and the covariance (C, C), not corrected for the sample."""
    rows = x.flatten(0, 1)
    mean = rows.mean(0)
    centred = rows - mean
    return mean, centred.T @ centred / len(rows)


def _gather(x: Tensor, index: Tensor) -> Tensor:
    """The chosen points, (B, outputs, C)."""
    return x.gather(1, index.unsqueeze(2).expand(-1, -1, x.shape[2]))


@torch.no_grad()
def _move_statistics(norm: nn.BatchNorm2d, mean: Tensor, variance: Tensor, count: int) -> None:
    momentum = 0.1 if norm.momentum is None else norm.momentum
    corrected = variance * (count / max(count - 1, 1))
    norm.get_buffer("running_mean").lerp_(mean, momentum)
    norm.get_buffer("running_var").lerp_(corrected, momentum)
    norm.get_buffer("num_batches_tracked").add_(1)
