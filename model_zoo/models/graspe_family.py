"""What GrASPE and its ablations share: the encoders, the loss, the order of the features."""

from __future__ import annotations

from abc import abstractmethod

from torch import Tensor

from graspe_data.manifest import Settings
from model_zoo.bounds import Steps, Weight
from model_zoo.contract import Features, Loss, Observation, SuccessModel
from model_zoo.layers.pointnet import orthogonality_penalty
from model_zoo.layers.reliability_graph import FeatureCounts
from model_zoo.layers.sensor_encoders import SensorEncoders, SensorEncoderSettings
from model_zoo.masked_cross_entropy import masked_cross_entropy


class GraspeFamilySettings(Settings):
    """What every model of the family can set.

    Attributes:
        horizon: Steps predicted, T.
        encoders: The four encoders.
        orthogonality: Weight of the penalty on PointNet's feature transform, where it has one.
    """

    horizon: Steps = 10
    encoders: SensorEncoderSettings = SensorEncoderSettings()
    orthogonality: Weight = 0.001


class GraspeFamily(SuccessModel):
    """Four encoders, and a fusion of their features that each model brings."""

    def __init__(self, settings: GraspeFamilySettings) -> None:
        """Make the encoders."""
        super().__init__()
        self.settings = settings
        self.horizon = settings.horizon
        self.counts = FeatureCounts()
        self.encoders = SensorEncoders(settings.encoders, self.counts)

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
        """Cross-entropy of the judged steps, and the penalty on PointNet's feature transform."""
        features, transform = self.encoders.scene(observation)
        logits = self.score_each(features, observation)
        entropy = masked_cross_entropy(logits, success, mask, weight)
        if transform is None:
            return Loss(entropy, logits)
        penalty = self.settings.orthogonality * orthogonality_penalty(transform.float())
        parts = {"cross_entropy": entropy, "orthogonality": penalty}
        return Loss(entropy + penalty, logits, parts)
