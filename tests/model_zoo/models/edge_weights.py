"""W of equation (6) of GrASPE, as the paper writes it."""

from __future__ import annotations

import torch
from torch import Tensor

from model_zoo.models.graspe import ReliabilityGraph


def edge_weights(
    graph: ReliabilityGraph, features: Tensor, r_img: Tensor, r_point: Tensor
) -> Tensor:
    """(B, N, N), the diagonal 0: the graph itself gives W + I."""
    weights: Tensor = graph(features, r_img, r_point) - torch.eye(graph.nodes)
    return weights
