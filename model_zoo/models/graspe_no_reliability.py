"""GrASPE without reliability: r_ij = 1 for all pairs in equation (6)."""

from __future__ import annotations

from torch import Tensor

from model_zoo.contract import Observation
from model_zoo.layers.attention_graph_network import AttentionGraphNetwork
from model_zoo.layers.sensor_encoders import COLUMNS
from model_zoo.models.graspe import GraspeSettings
from model_zoo.models.graspe_family import GraspeFamily


class GraspeNoReliability(GraspeFamily):
    """The ablation "GrASPE w/o reliability": GrASPE's layers, and no column of reliabilities."""

    columns = COLUMNS
    candidate_columns = ("trajectory_image",)

    def __init__(self, settings: GraspeSettings) -> None:
        """Make the model with random weights."""
        super().__init__(settings)
        self.graph = AttentionGraphNetwork(settings.horizon, settings.graph, self.counts)

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:  # noqa: ARG002
        """Log-odds of success (K, T) by A-GNN, every sensor as reliable as can be."""
        reliable = vector.new_ones(1)
        return self.graph(vector, reliable, reliable)  # type: ignore[no-any-return]
