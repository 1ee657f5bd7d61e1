"""What the variants of NMFNet share: the branches for the scene, and the loss."""

from __future__ import annotations

from torch import Tensor

from model_zoo.bounds import Share, Steps, Weight
from model_zoo.contract import Features, Loss, Observation, SuccessModel
from model_zoo.layers.pointnet import orthogonality_penalty
from model_zoo.layers.scene_branches import SceneBranches, SceneSettings
from model_zoo.masked_cross_entropy import masked_cross_entropy


class NmfnetSettings(SceneSettings):
    """The numbers of NMFNet.

    Attributes:
        horizon: Steps predicted, T.
        dropout: Of the scene's vector, before the last layer.
        orthogonality: Weight of the penalty on PointNet's feature transform, where it has one.
    """

    horizon: Steps = 10
    dropout: Share = 0.5
    orthogonality: Weight = 0.001


class NmfnetFamily(SuccessModel):
    """Branches for the scene, and a head that each variant brings.

    Where the published network has one steering angle, this one has T log-odds.
    """

    def __init__(self, settings: NmfnetSettings) -> None:
        """Make the branches with random weights."""
        super().__init__()
        self.horizon = settings.horizon
        self.orthogonality = settings.orthogonality
        self.scene = SceneBranches(settings)

    def encode(self, scene: Observation) -> Features:
        """The scene's vector, (B, F)."""
        return {"scene_features": self.scene(scene).vector}

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        """Cross-entropy of the judged steps, and the penalty on PointNet's feature transform."""
        vector, transform = self.scene(observation)
        logits = self.score_each({"scene_features": vector}, observation)
        entropy = masked_cross_entropy(logits, success, mask, weight)
        if transform is None:
            return Loss(entropy, logits)
        penalty = self.orthogonality * orthogonality_penalty(transform.float())
        parts = {"cross_entropy": entropy, "orthogonality": penalty}
        return Loss(entropy + penalty, logits, parts)
