"""The velocity history to features: four linear dilated convolutions (GrASPE, section IV-B3)."""

from __future__ import annotations

from itertools import pairwise

from torch import Tensor, nn

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.bounds import Kernel, Steps, Width

DILATIONS = (3, 2, 2, 2)


class VelocityNetSettings(Settings):
    """The sizes of a VelNet.

    Kernel 11 and 2 last channels are ours: with the printed dilations, stride 1 and no padding they
    are the odd kernel that takes 100 numbers to 2 x 10, the 20 features printed.

    Attributes:
        steps: Of the history.
        channels: Of the four convolutions.
        kernel: Of each of them.
    """

    steps: Steps = 50
    channels: tuple[Width, Width, Width, Width] = (8, 16, 8, 2)
    kernel: Kernel = 11


class VelocityNet(nn.Module):
    """Histories (B, steps, 2) of (v, w) to ``outputs`` numbers each, not activated."""

    def __init__(self, outputs: int, settings: VelocityNetSettings) -> None:
        """Make the convolutions.

        Raises:
            ZooError: The sizes do not give ``outputs`` numbers.
        """
        super().__init__()
        length = 2 * settings.steps - (settings.kernel - 1) * sum(DILATIONS)
        if length < 1 or length * settings.channels[-1] != outputs:
            raise ZooError(
                f"VelNet: {settings.steps} steps, kernel {settings.kernel} and "
                f"{settings.channels[-1]} last channels give {max(length, 0)} x "
                f"{settings.channels[-1]} numbers, expected {outputs}; change one of them."
            )
        pairs = zip(pairwise((1, *settings.channels)), DILATIONS, strict=True)
        self.convolutions = nn.Sequential(
            *(nn.Conv1d(*pair, settings.kernel, dilation=dilation) for pair, dilation in pairs)
        )
        self.apply(_initialise)

    def forward(self, history: Tensor) -> Tensor:
        """The numbers (B, outputs); V_t is the history with v and w in turn."""
        return self.convolutions(history.flatten(1)[:, None]).flatten(1)  # type: ignore[no-any-return]


def _initialise(module: nn.Module) -> None:
    """Weights that keep the variance where no activation follows."""
    if isinstance(module, nn.Conv1d):
        nn.init.kaiming_normal_(module.weight, nonlinearity="linear")
