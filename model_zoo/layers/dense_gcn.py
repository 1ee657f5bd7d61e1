"""Graph convolution (Kipf and Welling, ICLR 2017) on weighted graphs given as matrices."""

from __future__ import annotations

import torch
from torch import Tensor, nn


class DenseGcn(nn.Module):
    """H' = D^-1/2 (W + I) D^-1/2 H Theta + b, D the row sums of W + I.

    On a batch of graphs of N nodes it gives what PyTorch Geometric's ``GCNConv`` gives on their
    edge lists with edge weights; parameters are named as there, so its state dict loads.
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        """Make Theta and b."""
        super().__init__()
        self.lin = nn.Linear(inputs, outputs, bias=False)
        self.bias = nn.Parameter(torch.zeros(outputs))
        nn.init.xavier_uniform_(self.lin.weight)

    def forward(self, x: Tensor, adjacency: Tensor, scale: Tensor) -> Tensor:
        """The nodes' new features (B, N, outputs).

        Args:
            x: The nodes' features (B, N, inputs).
            adjacency: W + I, symmetric, (B, N, N).
            scale: What :func:`degree_scale` gives for it.
        """
        if self.lin.in_features < self.lin.out_features:
            mixed: Tensor = self.lin(_propagate(x, adjacency, scale))
        else:
            mixed = _propagate(self.lin(x), adjacency, scale)
        return mixed + self.bias


def degree_scale(adjacency: Tensor) -> Tensor:
    """The diagonal of D^-1/2, (B, N, 1), from W + I, (B, N, N)."""
    return torch.rsqrt(adjacency.sum(2, keepdim=True))


def _propagate(x: Tensor, adjacency: Tensor, scale: Tensor) -> Tensor:
    """D^-1/2 (W + I) D^-1/2 H, transposed within: few rows multiply faster than few columns."""
    return torch.bmm((x * scale).mT, adjacency).mT * scale
