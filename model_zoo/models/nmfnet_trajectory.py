"""NMFNet that also sees the trajectory: variant B, a stronger control than the published one."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import model_validator
from torch import Tensor, nn
from torch.nn.functional import linear

from model_zoo.bounds import Side, Units
from model_zoo.contract import Features, Observation
from model_zoo.layers.path_branch import PathBranch, check_path_rows
from model_zoo.layers.scene_branches import COLUMNS
from model_zoo.models.nmfnet_family import NmfnetFamily, NmfnetSettings


class NmfnetTrajectorySettings(NmfnetSettings):
    """The numbers of NMFNet with a branch for the path.

    Attributes:
        path_rows: Rows of the trajectory image that are read, from its lower edge.
        path_features: Length of the path's vector.
    """

    path_rows: Side = 128
    path_features: Units = 64

    @model_validator(mode="after")
    def _rows_of_the_picture(self) -> Self:
        check_path_rows(self.path_rows, self.picture_size[0])
        return self


class NmfnetTrajectory(NmfnetFamily):
    """NMFNet's branches and PAAD's branch for the path, joined before the last layer."""

    columns: ClassVar[tuple[str, ...]] = (*COLUMNS, "trajectory_image")
    candidate_columns: ClassVar[tuple[str, ...]] = ("trajectory_image",)

    def __init__(self, settings: NmfnetTrajectorySettings) -> None:
        """Make it with random weights."""
        super().__init__(settings)
        rows, features = settings.path_rows, settings.path_features
        self.path = PathBranch(rows, settings.picture_size[1], settings.shrink, features)
        self.dropout = nn.Dropout(settings.dropout)
        self.last = nn.Linear(self.scene.length + features, settings.horizon)

    def score(self, features: Features, candidates: Observation) -> Tensor:
        """Log-odds of success (K, T) from the scene's vector and the trajectory image.

        The last layer reads both side by side; the scene's part of it is computed once a scene.
        """
        vector = self.dropout(features["scene_features"])
        path = self.path(candidates["trajectory_image"])
        weight, bias, length = self.last.weight, self.last.bias, self.scene.length
        return linear(vector, weight[:, :length], bias) + linear(path, weight[:, length:])
