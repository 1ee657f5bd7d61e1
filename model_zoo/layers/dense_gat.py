"""Graph attention (Velickovic et al., ICLR 2018) with edge weights, on complete graphs."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import Tensor, nn
from torch.nn.functional import leaky_relu

NEGATIVE_SLOPE = 0.2
AT_ONCE = 4
"""Graphs whose scores are made at once: those of 120 nodes and 4 heads fit a core's cache."""


class DenseGat(nn.Module):
    """Multi-head attention of every node to all nodes, the edge's weight a term of its score.

    On a batch of complete graphs of N nodes it gives what PyTorch Geometric's
    ``GATConv(edge_dim=1, add_self_loops=True, fill_value="mean")`` gives on their edge lists;
    parameters are named as there, so its state dict loads. The scores, (heads, N, N) a graph, are
    the largest tensor: the edge's term is a scalar, so edges are never projected.
    """

    def __init__(self, inputs: int, channels: int, heads: int) -> None:
        """Make the heads; their outputs are concatenated, heads x channels a node."""
        super().__init__()
        self.heads = heads
        self.lin = nn.Linear(inputs, heads * channels, bias=False)
        self.lin_edge = nn.Linear(1, heads * channels, bias=False)
        self.att_src, self.att_dst, self.att_edge = (
            nn.Parameter(torch.empty(1, heads, channels)) for _ in range(3)
        )
        self.bias = nn.Parameter(torch.zeros(heads * channels))
        for weight in (self.lin, self.lin_edge):
            nn.init.xavier_uniform_(weight.weight)
        for vector in (self.att_src, self.att_dst, self.att_edge):
            nn.init.xavier_uniform_(vector.data[0])

    def focus(self, most: float) -> None:
        """Begin with heads that look at all nodes, ever nearer ones, and the nearest alone.

        Args:
            most: By how much, in nats, the last head's score of a node of weight 1 is above that of
                a node of weight 0; the first head's are alike, those between lie evenly.
        """
        channels = self.att_edge.shape[2]
        scores = torch.linspace(0, most, self.heads) if self.heads > 1 else torch.tensor([most])
        share = (scores / channels).sqrt()[:, None].expand(-1, channels)
        with torch.no_grad():
            self.att_edge.copy_(share[None])
            self.lin_edge.weight.copy_(share.reshape(-1, 1))

    def forward(self, x: Tensor, adjacency: Tensor) -> Tensor:
        """The nodes' new features (B, N, heads x channels).

        Args:
            x: The nodes' features (B, N, inputs).
            adjacency: W + I, the edges' weights with 1 on the diagonal, (B, N, N).
        """
        rows, nodes, _ = x.shape
        hidden: Tensor = self.lin(x).view(rows, nodes, self.heads, -1).transpose(1, 2)
        target = hidden @ self.att_dst.unsqueeze(3)
        source = (hidden @ self.att_src.unsqueeze(3)).mT
        edge = (self.lin_edge.weight.view_as(self.att_edge) * self.att_edge).sum(2)[
            :, :, None, None
        ]
        graphs = (target, source, _with_self_loops(adjacency)[:, None], hidden)
        mixed = torch.cat([_attend(edge, *some) for some in _parts(graphs)])
        return mixed.flatten(1, 2).mT + self.bias


def _parts(graphs: tuple[Tensor, ...]) -> Iterable[tuple[Tensor, ...]]:
    """A few graphs at a time; all at once while exporting, when their number is not known."""
    if torch.compiler.is_compiling():
        return [graphs]
    return zip(*(torch.split(each, AT_ONCE) for each in graphs), strict=True)


def _attend(
    edge: Tensor, target: Tensor, source: Tensor, weights: Tensor, hidden: Tensor
) -> Tensor:
    """hidden^T @ softmax(scores)^T: how much node i (axis 2) attends to node j (axis 3).

    In place, for the scores' size; transposed, since MKL multiplies few rows by many columns up to
    five times faster.
    """
    scores = (target + source).addcmul_(weights, edge)
    scores = leaky_relu(scores, NEGATIVE_SLOPE, inplace=True)
    return hidden.mT @ torch.softmax(scores, 3).mT


def _with_self_loops(adjacency: Tensor) -> Tensor:
    """W whose diagonal is the mean of the other weights in the row, (B, N, N)."""
    nodes = adjacency.shape[1]
    mean = (adjacency.sum(2, keepdim=True) - 1) / (nodes - 1)
    return torch.addcmul(adjacency, torch.eye(nodes, device=adjacency.device), mean - 1)
