"""PAAD, proactive anomaly detection (Ji et al., RA-L 2022), on this dataset's columns."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator
from torch import Tensor
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
from model_zoo.layers.attention_fusion import AttentionFusion
from model_zoo.layers.image_branch import ImageBranch
from model_zoo.layers.path_branch import PathBranch, check_path_rows
from model_zoo.layers.svae import Posterior, ScanAutoencoder
from model_zoo.picture_input import normalised_picture
from model_zoo.scan_input import clipped_scan

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

    Layer by layer tianchenji/PAAD, nets/PAAD.py. Within, 1 is failure, as there: what it
    publishes and is taught is success, as everywhere. It reads no velocity history, no points
    and no reliability.

    Attributes:
        columns: See :class:`SuccessModel`.
        candidate_columns: See :class:`SuccessModel`.
        horizon: See :class:`SuccessModel`.
        settings: Its sizes.
    """

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
        ranges = self._ranges(observation)
        codes = self.scan.encode(ranges)
        sampled = codes.sample() if self.training else codes.mean
        logits = self.score_each(self._features(observation, codes), observation).float()
        entropy = binary_cross_entropy_with_logits(logits, success, reduction="none")
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
