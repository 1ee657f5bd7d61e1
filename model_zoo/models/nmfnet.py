"""NMFNet (Nguyen et al., IROS 2020), made to predict success: variant A."""

from __future__ import annotations

from typing import ClassVar

from torch import Tensor, nn

from model_zoo.contract import Features, Observation
from model_zoo.layers.scene_branches import COLUMNS
from model_zoo.models.nmfnet_family import NmfnetFamily, NmfnetSettings


class Nmfnet(NmfnetFamily):
    """The published network: it knows nothing of the trajectory.

    Whatever the candidate, it says how the motion under way will fare in this scene. So it can
    stop a robot, and not choose between candidates.
    """

    columns: ClassVar[tuple[str, ...]] = COLUMNS

    def __init__(self, settings: NmfnetSettings) -> None:
        """Make it with random weights."""
        super().__init__(settings)
        self.head = nn.Sequential(
            nn.Dropout(settings.dropout), nn.Linear(self.scene.length, settings.horizon)
        )

    def score(self, features: Features, candidates: Observation) -> Tensor:  # noqa: ARG002
        """Log-odds of success (B, T) from the scene's vector alone, whatever the candidates."""
        found: Tensor = self.head(features["scene_features"])
        return found
