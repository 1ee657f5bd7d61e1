"""NMFNet that also sees the trajectory: variant B, a stronger control than the published one."""

from __future__ import annotations

from typing import Annotated, ClassVar

import torch
from pydantic import Field
from torch import Tensor, nn

from model_zoo.contract import Observation
from model_zoo.layers.path_branch import PathBranch
from model_zoo.layers.scene_branches import COLUMNS
from model_zoo.models.nmfnet_family import NmfnetFamily, NmfnetSettings


class NmfnetTrajectorySettings(NmfnetSettings):
    """The numbers of NMFNet with a branch for the path.

    Attributes:
        path_rows: Rows of the trajectory image that are read, from its lower edge.
        path_features: Length of the path's vector.
    """

    path_rows: Annotated[int, Field(gt=0)] = 128
    path_features: Annotated[int, Field(gt=0)] = 64


class NmfnetTrajectory(NmfnetFamily):
    """NMFNet's branches and PAAD's branch for the path, joined before the last layer."""

    columns: ClassVar[tuple[str, ...]] = (*COLUMNS, "trajectory_image")

    def __init__(self, settings: NmfnetTrajectorySettings) -> None:
        """Make it with random weights."""
        super().__init__(settings)
        rows, features = settings.path_rows, settings.path_features
        self.path = PathBranch(rows, settings.picture_size[1], settings.shrink, features)
        self.dropout = nn.Dropout(settings.dropout)
        self.last = nn.Linear(self.scene.length + features, settings.horizon)

    def predict(self, scene: Tensor, observation: Observation) -> Tensor:
        """Log-odds of success (B, T) from the scene's vector and the trajectory image."""
        path = self.path(observation["trajectory_image"])
        found: Tensor = self.last(torch.cat((self.dropout(scene), path), dim=1))
        return found
