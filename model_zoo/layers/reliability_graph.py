"""The reliability-aware feature graph, equations (6) and (7) of GrASPE, for a batch at once."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn


class FeatureCounts(NamedTuple):
    """How many nodes come from each sensor, in the order of the feature vector f_vec."""

    image: int = 40
    point: int = 40
    trajectory: int = 20
    velocity: int = 20

    @property
    def nodes(self) -> int:
        """N, 120 as printed."""
        return sum(self)


class ReliabilityGraph(nn.Module):
    """Features (B, N) and reliabilities (B,) to the weights (B, N, N) of a complete graph.

    What does not depend on the observation is kept as a constant, so that r_ij of a whole batch is
    one matrix product.
    """

    pattern: Tensor
    rates: Tensor

    def __init__(self, counts: FeatureCounts, decay: float) -> None:
        """Prepare the graph.

        Args:
            counts: Nodes of each sensor.
            decay: Lambda of equation (6), above 0.
        """
        super().__init__()
        self.nodes = counts.nodes
        pattern = _pattern(counts)
        # -lambda (2 - r_ij) is a share of r_img, r_point and 1 as well.
        rates = decay * (pattern - torch.tensor([[0.0], [0.0], [2.0]]))
        self.register_buffer("pattern", pattern, persistent=False)
        self.register_buffer("rates", rates, persistent=False)

    def reliability_matrix(self, r_img: Tensor, r_point: Tensor) -> Tensor:
        """Equation (7): r_ij, (B, N, N), from r_img and r_point, (B,)."""
        return self._mix(r_img, r_point, self.pattern)

    def forward(self, features: Tensor, r_img: Tensor, r_point: Tensor) -> Tensor:
        """W + I of equation (6): exp(-lambda |f_i - f_j| (2 - r_ij)), which is 1 where i = j."""
        distance = (features[:, :, None] - features[:, None, :]).abs_()
        return distance.mul_(self._mix(r_img, r_point, self.rates)).exp_()

    def edge_weights(self, features: Tensor, r_img: Tensor, r_point: Tensor) -> Tensor:
        """W of equation (6), (B, N, N), its diagonal 0."""
        identity = torch.eye(self.nodes, device=features.device)
        return self(features, r_img, r_point) - identity  # type: ignore[no-any-return]

    def _mix(self, r_img: Tensor, r_point: Tensor, shares: Tensor) -> Tensor:
        sources = torch.stack([r_img, r_point, torch.ones_like(r_img)], dim=1)
        return (sources @ shares).view(-1, self.nodes, self.nodes)


def _pattern(counts: FeatureCounts) -> Tensor:
    """The shares (3, N * N) of r_img, r_point and 1 in every r_ij."""
    sensor = torch.repeat_interleave(torch.arange(4), torch.tensor(counts))
    is_image, is_point = sensor == 0, sensor == 1
    image = is_image[:, None] | is_image[None]
    point = is_point[:, None] | is_point[None]
    # A node cannot be both, so image & point is a pair of one image and one point node.
    between = (image & point) * 0.5
    parts = [(image & ~point) + between, (point & ~image) + between, ~(image | point) * 1.0]
    return torch.stack(parts).flatten(1)
