"""PAAD, proactive anomaly detection (Ji et al., RA-L 2022), on this dataset's columns.

Layer by layer tianchenji/PAAD, nets/PAAD.py. Shapes: B scenes, K candidate trajectories, T = 10
steps, F = 64 features of a branch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Self

import torch
from pydantic import Field, model_validator
from torch import Tensor, nn
from torch.nn.functional import binary_cross_entropy_with_logits

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.bounds import (
    NO_TRUTH,
    Beams,
    Heads,
    Metres,
    Share,
    Shrink,
    Side,
    Steps,
    Units,
    Width,
)
from model_zoo.contract import Features, Loss, Observation, SuccessModel
from model_zoo.layers.path_branch import PathBranch, check_path_rows
from model_zoo.layers.picture_input import normalised_picture
from model_zoo.layers.resnet18 import ResNet18
from model_zoo.layers.scan_input import clipped_scan

REDUCED, CHANNELS = 64, 32


class ImageBranch(nn.Module):
    """ResNet18's trunk, two convolutions and a dense layer (tianchenji/PAAD, nets/PAAD.py).

    A picture of 240 x 320 becomes 64 x 4 x 5, then 32 x 4 x 5 features.
    """

    def __init__(self, height: int, width: int, features: int = 64, trunk_width: int = 64) -> None:
        """Build it for pictures of one size.

        Args:
            height: Rows of the picture.
            width: Columns of the picture.
            features: Length of the branch's vector.
            trunk_width: Channels of the trunk's first stage.
        """
        super().__init__()
        self.resnet = ResNet18(1, trunk_width, reduction=None)
        del self.resnet.fc
        self.reduction = nn.Conv2d(8 * trunk_width, REDUCED, 3, stride=2, padding=1)
        self.convolution = nn.Sequential(nn.Conv2d(REDUCED, CHANNELS, 3, padding=1), nn.ReLU())
        pixels = -(-height // 64) * -(-width // 64)
        self.dense = nn.Sequential(nn.Flatten(), nn.Linear(CHANNELS * pixels, features), nn.ReLU())

    def freeze(self) -> None:
        """Keep the trunk's and the reduction's weights; batch statistics go on, as in PAAD."""
        self.resnet.requires_grad_(requires_grad=False)
        self.reduction.requires_grad_(requires_grad=False)

    def reduced(self, picture: Tensor) -> Tensor:
        """What the trunk and the reduction, not rectified, make of a picture: (B, 64, h, w)."""
        maps: Tensor = self.reduction(self.resnet.trunk(picture))
        return maps

    def forward(self, picture: Tensor) -> Tensor:
        """Features (B, F) of normalised pictures (B, 3, H, W)."""
        vector: Tensor = self.dense(self.convolution(self.reduced(picture)))
        return vector


@dataclass(frozen=True)
class Posterior:
    """A diagonal normal distribution of codes for each scan: means, log variances, (B, L)."""

    mean: Tensor
    log_variance: Tensor

    @property
    def features(self) -> Tensor:
        """Means and log variances side by side, (B, 2 L): what a classifier reads."""
        return torch.cat((self.mean, self.log_variance), dim=1)

    def sample(self) -> Tensor:
        """Draw one code a scan, (B, L), so that gradients reach the distribution."""
        return self.mean + torch.exp(self.log_variance / 2) * torch.randn_like(self.mean)

    def divergence(self) -> Tensor:
        """Kullback-Leibler divergence from the standard normal, (B,), nats."""
        mean, log_variance = self.mean.float(), self.log_variance.float()
        return 0.5 * (mean**2 + log_variance.exp() - 1 - log_variance).sum(dim=1)


class ScanAutoencoder(nn.Module):
    """Encodes a scan and reconstructs it (tianchenji/Multimodal-SVAE and PAAD, nets/SVAE.py)."""

    def __init__(self, beams: int, hidden: int = 128, latent: int = 32) -> None:
        """Fully connected throughout.

        Args:
            beams: Rays of a scan.
            hidden: Units of the one hidden layer on either side.
            latent: Length of a code, L.
        """
        super().__init__()
        self.encoder = nn.Sequential(nn.Linear(beams, hidden), nn.ReLU())
        self.mean = nn.Linear(hidden, latent)
        self.log_variance = nn.Linear(hidden, latent)
        self.decoder = nn.Sequential(
            nn.Linear(latent, hidden), nn.ReLU(), nn.Linear(hidden, beams), nn.Sigmoid()
        )

    def encode(self, scan: Tensor) -> Posterior:
        """The codes' distribution for scans (B, beams) within [0, 1]."""
        hidden = self.encoder(scan)
        return Posterior(self.mean(hidden), self.log_variance(hidden))

    def reconstruction_error(self, scan: Tensor, code: Tensor) -> Tensor:
        """Squared error of the scans (B, beams) that codes (B, L) stand for, summed: (B,)."""
        rebuilt: Tensor = self.decoder(code)
        return (rebuilt.float() - scan).square().sum(dim=1)


class AttentionFusion(nn.Module):
    """One self-attention over two tokens, added to them, and two dense layers.

    Neither positions nor a layer normalisation, and the path takes no part in the attention
    (tianchenji/PAAD, nets/PAAD.py).
    """

    def __init__(self, features: int, heads: int, hidden: int, dropout: float, steps: int) -> None:
        """Build it.

        Args:
            features: Length of each branch's vector, F.
            heads: Of the attention; they divide F.
            hidden: Units of the first dense layer.
            dropout: After it.
            steps: Outputs, T.
        """
        super().__init__()
        self.attention = nn.MultiheadAttention(features, heads, batch_first=True)
        self.head = nn.Sequential(
            nn.Linear(3 * features, hidden),
            nn.ReLU(),
            nn.Dropout(dropout),
            nn.Linear(hidden, steps),
        )

    def scene(self, picture: Tensor, scan: Tensor) -> Tensor:
        """What all paths in a scene share: vectors (B, F) that attended to each other, (B, 2 F)."""
        tokens = torch.stack((picture, scan), dim=1)
        attended, _ = self.attention(tokens, tokens, tokens, need_weights=False)
        fused: Tensor = (attended + tokens).flatten(1)
        return fused

    def forward(self, scene: Tensor, path: Tensor) -> Tensor:
        """Outputs (K, T), not activated, of paths (K, F) in as many scenes (K, 2 F), or in one."""
        fused = torch.cat((scene.expand(path.shape[0], -1), path), dim=1)
        outputs: Tensor = self.head(fused)
        return outputs


ALPHA_PER_BATCH = 0.01


class PaadSettings(Settings):
    """The sizes of PAAD.

    Attributes:
        horizon: Steps predicted, T.
        picture_size: Rows and columns of the picture and of the trajectory image.
        path_rows: Rows of the trajectory image that are read, from its lower edge.
        shrink: Pixels of each side of the squares that become one, in both pictures, first.
        trunk_width: Channels of ResNet18's first stage.
        freeze_trunk: Whether the trunk and the convolution after it keep their weights, as PAAD
            does with those of a network for crop rows. There are none of it here: train them.
        beams: Rays of a scan; PAAD's scanner has 1081.
        scan_limit: Metres beyond which a scan reads as empty: a little more than the path's
            length. PAAD takes 1.85 in its rows of crops.
        hidden: Units of the scan's coder and of the head.
        features: Length of each branch's vector; half of it is the scan's code.
        heads: Of the attention between picture and scan.
        dropout: Before the last layer.
        alpha: Weight of the cross-entropy against the scan's terms; ``auto`` is 0.01 times the
            batches of an epoch.
    """

    horizon: Steps = 10
    picture_size: tuple[Side, Side] = (240, 320)
    path_rows: Side = 128
    shrink: Shrink = 1
    trunk_width: Width = 64
    freeze_trunk: bool = False
    beams: Beams = 720
    scan_limit: Metres = 4.5
    hidden: Units = 128
    features: Annotated[int, Field(strict=True, ge=2, le=16_384, multiple_of=2)] = 64
    heads: Heads = 8
    dropout: Share = 0.5
    alpha: Literal["auto"] | Annotated[float, Field(gt=0, le=1_000_000), NO_TRUTH] = "auto"

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        if self.features % self.heads:
            raise ValueError(f"features {self.features} are no multiple of heads {self.heads}")
        check_path_rows(self.path_rows, self.picture_size[0])
        return self


class Paad(SuccessModel):
    """Picture and scan attend to each other; the path joins them before the head.

    Within, 1 is failure, as there: what it
    publishes and is taught is success, as everywhere. It reads no velocity history, no points
    and no reliability.

    Attributes:
        columns: See :class:`SuccessModel`.
        candidate_columns: See :class:`SuccessModel`.
        horizon: See :class:`SuccessModel`.
        settings: Its sizes.
    """

    name = "paad"
    settings_type = PaadSettings
    columns: ClassVar[tuple[str, ...]] = ("image", "trajectory_image", "laser_scan")
    candidate_columns: ClassVar[tuple[str, ...]] = ("trajectory_image",)

    def __init__(self, settings: PaadSettings) -> None:
        """Make it with random weights."""
        super().__init__()
        self.settings, self.horizon = settings, settings.horizon
        self._alpha = None if settings.alpha == "auto" else settings.alpha
        rows, columns = (side // settings.shrink for side in settings.picture_size)
        features, hidden = settings.features, settings.hidden
        self.image = ImageBranch(rows, columns, features, settings.trunk_width)
        self.path = PathBranch(
            settings.path_rows, settings.picture_size[1], settings.shrink, features
        )
        self.scan = ScanAutoencoder(settings.beams, hidden, features // 2)
        self.fusion = AttentionFusion(
            features, settings.heads, hidden, settings.dropout, settings.horizon
        )
        if settings.freeze_trunk:
            self.image.freeze()

    @property
    def alpha(self) -> float:
        """Weight of the cross-entropy in the loss.

        Raises:
            ZooError: It is ``auto``, and :meth:`begin_training` was not called.
        """
        if self._alpha is None:
            raise ZooError(
                "paad: alpha is 'auto', 0.01 times the batches of an epoch, and their number is "
                "not known; call begin_training(batches), or give alpha a number."
            )
        return self._alpha

    def begin_training(self, batches: int) -> None:
        """Take the number of batches in an epoch, which fixes an ``auto`` alpha."""
        if self.settings.alpha == "auto":
            self._alpha = ALPHA_PER_BATCH * batches

    def encode(self, scene: Observation) -> Features:
        """Picture and scan, fused."""
        return self._features(scene, self.scan.encode(self._ranges(scene)))

    def score(self, features: Features, candidates: Observation) -> Tensor:
        """Log-odds of success, (K, T)."""
        path = self.path(candidates["trajectory_image"])
        failure: Tensor = self.fusion(features["scene_features"], path)
        return -failure

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        """Squared error of the scan + divergence of its codes + alpha * cross-entropy.

        Each is summed over a row and averaged over rows by their weight (PAAD, utils.py). Steps
        that are not judged count nothing. In training the scan is rebuilt from a sampled code,
        else from the mean.
        """
        # The scan, (B, beams) within 0 and 1, and its codes' distribution, (B, F / 2) twice.
        ranges = self._ranges(observation)
        codes = self.scan.encode(ranges)
        sampled = codes.sample() if self.training else codes.mean
        # Steps' cross-entropy, (B, T).
        logits = self.score_each(self._features(observation, codes), observation).float()
        entropy = binary_cross_entropy_with_logits(logits, success, reduction="none")
        # The three terms, each a mean over rows.
        scan_weight = weight.view(len(ranges), -1).mean(dim=1)
        reconstruction = self.scan.reconstruction_error(ranges, sampled)
        means = {
            "reconstruction": _mean(reconstruction, scan_weight),
            "divergence": _mean(codes.divergence(), scan_weight),
            "cross_entropy": _mean((entropy * mask).sum(dim=1), weight),
        }
        scan = means["reconstruction"] + means["divergence"]
        total = scan + self.alpha * means["cross_entropy"]
        judged = float(_mean(mask.sum(dim=1).float(), weight))
        return Loss(total, logits, means, entropy_scale=self.alpha * judged)

    def _ranges(self, observation: Observation) -> Tensor:
        settings = self.settings
        return clipped_scan(observation["laser_scan"], settings.beams, settings.scan_limit)

    def _features(self, scene: Observation, codes: Posterior) -> Features:
        picture = self.image(normalised_picture(scene["image"], self.settings.shrink))
        return {"scene_features": self.fusion.scene(picture, codes.features)}


def _mean(rows: Tensor, weight: Tensor) -> Tensor:
    return (rows * weight).sum() / weight.sum().clamp_min(1e-9)
