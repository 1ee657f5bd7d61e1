"""What GrASPE and its ablations share: the encoders, the loss, the order of the features."""

from __future__ import annotations

from abc import abstractmethod

import torch
from pydantic import Field
from torch import Tensor, nn

from graspe_data.manifest import Settings
from model_zoo.contract import DRIVEN, Features, Loss, Observation, SuccessModel
from model_zoo.layers.pointnet import orthogonality_penalty
from model_zoo.layers.reliability_graph import FeatureCounts
from model_zoo.layers.sensor_encoders import SensorEncoders, SensorEncoderSettings
from model_zoo.masked_cross_entropy import masked_cross_entropy

_HIDDEN = 128


class GraspeFamilySettings(Settings):
    """What every model of the family can set.

    Attributes:
        horizon: Steps predicted, T.
        encoders: The four encoders.
        orthogonality: Weight of the penalty on PointNet's feature transform, where it has one.
        guide: Whether a dense network on f_vec learns beside the fusion, in training alone. Ours:
            encoders that are taught through the graph alone learn later than it could use.
    """

    horizon: int = Field(default=10, ge=1)
    encoders: SensorEncoderSettings = SensorEncoderSettings()
    orthogonality: float = Field(default=0.001, ge=0)
    guide: bool = False


class GraspeFamily(SuccessModel):
    """Four encoders, and a fusion of their features that each model brings."""

    def __init__(self, settings: GraspeFamilySettings) -> None:
        """Make the encoders."""
        super().__init__()
        self.settings = settings
        self.horizon = settings.horizon
        self.counts = FeatureCounts()
        self.encoders = SensorEncoders(settings.encoders, self.counts)
        self.guide = _guide(self.counts.nodes, settings.horizon) if settings.guide else None

    @abstractmethod
    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T) from f_vec, (K, 120)."""

    def encode(self, scene: Observation) -> Features:
        """The features of picture, points and velocities."""
        return self.encoders.scene(scene).features

    def score(self, features: Features, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T)."""
        return self.fuse(self.encoders.join(features, candidates["trajectory_image"]), candidates)

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        """Cross-entropy of the judged steps, of the guide too, and PointNet's penalty."""
        features, transform = self.encoders.scene(observation)
        repeated, candidates = self.each(features, observation)
        vector = self.encoders.join(repeated, candidates[DRIVEN])
        logits = self.fuse(vector, candidates)
        parts = {"cross_entropy": masked_cross_entropy(logits, success, mask, weight)}
        beside = None if self.guide is None else self.guide(vector)
        if beside is not None:
            parts["guide"] = masked_cross_entropy(beside, success, mask, weight)
        if transform is not None:
            penalty = orthogonality_penalty(transform.float())
            parts["orthogonality"] = self.settings.orthogonality * penalty
        total = torch.stack(list(parts.values())).sum()
        return Loss(total, logits, parts if len(parts) > 1 else {}, beside=beside)


def _guide(nodes: int, horizon: int) -> nn.Sequential:
    return nn.Sequential(nn.Linear(nodes, _HIDDEN), nn.ReLU(), nn.Linear(_HIDDEN, horizon))
