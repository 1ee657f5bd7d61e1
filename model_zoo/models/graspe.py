"""GrASPE: encoders, a reliability-aware feature graph, and attention on it."""

from __future__ import annotations

from torch import Tensor

from model_zoo.contract import Observation
from model_zoo.layers.attention_graph_network import (
    AttentionGraphNetwork,
    AttentionGraphSettings,
)
from model_zoo.layers.sensor_encoders import COLUMNS
from model_zoo.models.graspe_family import GraspeFamily, GraspeFamilySettings


class GraspeSettings(GraspeFamilySettings):
    """The numbers of GrASPE.

    Attributes:
        graph: A-GNN.
    """

    graph: AttentionGraphSettings = AttentionGraphSettings()


class Graspe(GraspeFamily):
    """GrASPE (Weerakoon et al., RA-L), section IV."""

    columns = (*COLUMNS, "r_img", "r_point")
    candidate_columns = ("trajectory_image", "r_img", "r_point")

    def __init__(self, settings: GraspeSettings) -> None:
        """Make the model with random weights."""
        super().__init__(settings)
        self.graph = AttentionGraphNetwork(settings.horizon, settings.graph, self.counts)

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T) by A-GNN."""
        return self.graph(vector, candidates["r_img"], candidates["r_point"])  # type: ignore[no-any-return]
