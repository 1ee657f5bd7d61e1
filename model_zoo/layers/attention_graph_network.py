"""A-GNN, the network on the feature graph (GrASPE, section IV-E and figure 4)."""

from __future__ import annotations

from typing import Annotated

import torch
from pydantic import Field
from torch import Tensor, nn
from torch.nn.functional import elu

from graspe_data.manifest import Settings
from model_zoo.bounds import NO_TRUTH, Heads, Share, Units, Width
from model_zoo.layers.dense_gat import DenseGat
from model_zoo.layers.dense_gcn import DenseGcn, degree_scale
from model_zoo.layers.reliability_graph import FeatureCounts, ReliabilityGraph


class AttentionGraphSettings(Settings):
    """The sizes of an A-GNN. Only the first layer's 16 channels are printed.

    Attributes:
        decay: Lambda of equation (6); it is not printed. Ours is the best of 2, 5, 20, 80: every
            two nodes have an edge, which with small lambda makes all nodes alike, layer by layer,
            and with large lambda passes little on.
        focus: How much its last head's attention prefers an edge of weight 1 to one of weight 0 at
            first, in nats; ours, for the same reason. None draws it as the others.
        channels: Of both graph convolutions.
        heads: Of the attention.
        head_channels: Of each of its heads.
        dropout: After the attention.
        hidden: Of the first of two dense layers.
        normalise: Whether the nodes are batch-normalised before the dense layers. Ours: what tells
            one trajectory from another in a scene reaches them a hundred times smaller than what
            tells scenes apart, and is not learned.
    """

    decay: Annotated[float, Field(gt=0, le=1000), NO_TRUTH] = 5.0
    focus: Annotated[float, Field(ge=0, le=100), NO_TRUTH] | None = 12.0
    channels: Width = 16
    heads: Heads = 4
    head_channels: Width = 4
    dropout: Share = 0.5
    hidden: Units = 128
    normalise: bool = True


class AttentionGraphNetwork(nn.Module):
    """Features of 120 nodes and two reliabilities to ``outputs`` numbers, not activated."""

    def __init__(
        self, outputs: int, settings: AttentionGraphSettings, counts: FeatureCounts | None = None
    ) -> None:
        """Make the layers: GCN, GAT, dropout, GCN, two dense ones."""
        super().__init__()
        counts = counts or FeatureCounts()
        attended = settings.heads * settings.head_channels
        self.graph = ReliabilityGraph(counts, settings.decay)
        self.first = DenseGcn(1, settings.channels)
        self.attention = DenseGat(settings.channels, settings.head_channels, settings.heads)
        if settings.focus is not None:
            self.attention.focus(settings.focus)
        self.dropout = nn.Dropout(settings.dropout)
        self.second = DenseGcn(attended, settings.channels)
        flat = counts.nodes * settings.channels
        self.norm = nn.BatchNorm1d(flat) if settings.normalise else nn.Identity()
        self.head = nn.Sequential(
            nn.Linear(flat, settings.hidden),
            nn.ReLU(),
            nn.Linear(settings.hidden, outputs),
        )

    def forward(self, features: Tensor, r_img: Tensor, r_point: Tensor) -> Tensor:
        """The numbers (B, outputs).

        Args:
            features: f_vec, (B, N), within 0 and 1.
            r_img: Reliability of the picture, (B,).
            r_point: Reliability of the points, (B,).
        """
        adjacency = self.graph(features, r_img, r_point)
        scale = degree_scale(adjacency)
        nodes = torch.relu(self.first(features[:, :, None], adjacency, scale))
        nodes = self.dropout(elu(self.attention(nodes, adjacency)))
        nodes = torch.relu(self.second(nodes, adjacency, scale))
        return self.head(self.norm(nodes.flatten(1)))  # type: ignore[no-any-return]
