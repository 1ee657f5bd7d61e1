"""GrASPE without A-GNN: its features into convolutions along the feature vector."""

from __future__ import annotations

from torch import Tensor, nn

from graspe_data.manifest import Settings
from model_zoo.bounds import Kernel, Share, Units, Width
from model_zoo.contract import Observation
from model_zoo.layers.sensor_encoders import COLUMNS
from model_zoo.models.graspe_family import GraspeFamily, GraspeFamilySettings


class ConvolutionSettings(Settings):
    """The sizes of the layers in A-GNN's place.

    Only "a set of 1D convolution layers" is printed. There are three, of A-GNN's width, with its
    dropout and its dense layers, so that the graph alone is what the ablation takes away.

    Attributes:
        channels: Of the three convolutions.
        kernel: Of each; the length is kept.
        dropout: After the second.
        hidden: Of the first of two dense layers.
        normalise: As A-GNN's.
    """

    channels: Width = 16
    kernel: Kernel = 3
    dropout: Share = 0.5
    hidden: Units = 128
    normalise: bool = True


class GraspeNoAgnnSettings(GraspeFamilySettings):
    """The numbers of GrASPE without A-GNN.

    Attributes:
        convolutions: The layers in A-GNN's place.
    """

    convolutions: ConvolutionSettings = ConvolutionSettings()


class GraspeNoAgnn(GraspeFamily):
    """The ablation "GrASPE w/o A-GNN"."""

    columns = COLUMNS
    candidate_columns = ("trajectory_image",)

    def __init__(self, settings: GraspeNoAgnnSettings) -> None:
        """Make the model with random weights."""
        super().__init__(settings)
        sizes = settings.convolutions
        self.convolutions = _convolutions(sizes)
        flat = self.counts.nodes * sizes.channels
        self.norm = nn.BatchNorm1d(flat) if sizes.normalise else nn.Identity()
        self.head = nn.Sequential(
            nn.Linear(flat, sizes.hidden),
            nn.ReLU(),
            nn.Linear(sizes.hidden, settings.horizon),
        )

    def fuse(self, vector: Tensor, candidates: Observation) -> Tensor:  # noqa: ARG002
        """Log-odds of success (K, T) by convolutions along f_vec."""
        return self.head(self.norm(self.convolutions(vector[:, None]).flatten(1)))  # type: ignore[no-any-return]


def _convolutions(settings: ConvolutionSettings) -> nn.Sequential:
    width, kernel = settings.channels, settings.kernel
    return nn.Sequential(
        nn.Conv1d(1, width, kernel, padding="same"),
        nn.ReLU(),
        nn.Conv1d(width, width, kernel, padding="same"),
        nn.ReLU(),
        nn.Dropout(settings.dropout),
        nn.Conv1d(width, width, kernel, padding="same"),
        nn.ReLU(),
    )
