"""How often which sensor fails in training, how badly, and what a dataset's sensors are."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, Field

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, Share, validate
from graspe_data.observation.image_reliability import ImageReliabilitySettings
from graspe_data.observation.laser_scan import LaserScanSettings
from graspe_data.observation.point_reliability import PointReliabilitySettings
from graspe_data.shards.dataset_index import DatasetIndex

Number = TypeVar("Number", int, float)


def _ordered(span: tuple[Number, Number]) -> tuple[Number, Number]:
    low, high = span
    if low > high:
        raise ValueError(f"the lower end {low:g} is above the upper end {high:g}")
    return span


Shares = Annotated[tuple[Share, Share], AfterValidator(_ordered)]
LightShare = Annotated[float, Field(gt=0, le=1)]
LightShares = Annotated[tuple[LightShare, LightShare], AfterValidator(_ordered)]
Length = Annotated[float, Field(ge=0, le=200)]
Lengths = Annotated[tuple[Length, Length], AfterValidator(_ordered)]
Angle = Annotated[float, Field(ge=0, le=2 * math.pi)]
Lag = Annotated[int, Field(ge=1, le=1000)]
Angles = Annotated[tuple[Angle, Angle], AfterValidator(_ordered)]


ReliabilitySource = Literal["measured", "shuffled", "known"]
"""``measured``: equations (1) to (5) of what the sensors gave.

Controls, to tell what a measured reliability is worth: ``shuffled`` gives each row those of another
row of its batch, which are as large and say nothing of it; ``known`` knows which sensor was made to
fail, 0, and which was not, 1, and nothing of failures that were recorded.
"""


class DarknessSettings(Settings):
    """Too little light for the camera."""

    probability: Share = 0.1
    """Of a row's picture being dark."""
    light: LightShares = (0.002, 0.2)
    """LightShare left, of what would be well exposed without amplification; drawn log-uniformly."""


class BlurSettings(Settings):
    """The camera moves while it exposes."""

    probability: Share = 0.1
    """Of a row's picture being blurred."""
    length: Lengths = (3.0, 25.0)
    """Pixels of the stored picture that everything moves, in any direction."""


class CoverSettings(Settings):
    """Leaves or dirt on the lens."""

    probability: Share = 0.1
    """Of a row's picture being covered."""
    share: Shares = (0.2, 0.95)
    """Of the picture that is covered."""
    wholly: Share = 0.2
    """Of the covered pictures, those of which nothing is left."""


class SectorLossSettings(Settings):
    """Something near the lidar hides a sector: no returns from there, in points and scan."""

    probability: Share = 0.1
    """Of a row losing a sector."""
    width: Angles = (0.3, 2.0)
    """Of the sector, rad; its middle lies anywhere in the scan."""
    wholly: Share = 0.1
    """Of the rows that lose a sector, those that lose all returns."""


class ThinningSettings(Settings):
    """Returns too weak to be seen: wet or dark surfaces, a dirty window."""

    probability: Share = 0.05
    """Of a row losing returns here and there."""
    share: Shares = (0.1, 0.7)
    """Of the returns that are lost."""


class ScatterSettings(Settings):
    """Returns from dust, rain or leaves on the way."""

    probability: Share = 0.05
    """Of a row with scattered returns."""
    share: Shares = (0.02, 0.3)
    """Of the returns that come from nearer than they should."""


class GlareSettings(Settings):
    """The sun in the lens."""

    probability: Share = 0.0
    """Of a row's picture."""
    strength: Shares = (0.2, 1.0)
    """1 leaves a bright spot in a veil."""


class DropletSettings(Settings):
    """Drops of water on the lens."""

    probability: Share = 0.0
    """Of a row's picture."""
    share: Shares = (0.1, 0.7)
    """Of the picture that they cover."""


class DustSettings(Settings):
    """Dust or rain before the lidar."""

    probability: Share = 0.0
    """Of a row's cloud."""
    strength: Shares = (0.2, 1.0)
    """How dense a puff is in its middle."""


class NearLeavesSettings(Settings):
    """Leaves half a metre before the lidar."""

    probability: Share = 0.0
    """Of a row's cloud."""
    share: Shares = (0.1, 0.7)
    """Of what is ahead that they hide."""


class LateHistorySettings(Settings):
    """The velocity history ends before the anchor.

    In a recording the trajectory is that of the velocity with which the history ends, so that a
    model can read it there and need not look at the trajectory image. A planner asks about other
    trajectories, while the history stays: what did not look will give all the same answer.
    """

    probability: Share = 0.5
    """Of a row's history being late."""
    lag: Annotated[tuple[Lag, Lag], AfterValidator(_ordered)] = (3, 15)
    """Steps of the history by which it is late."""


class ExposureSettings(Settings):
    """The camera that takes the degraded picture."""

    gain_limit: Annotated[float, Field(ge=1, le=256)] = 8.0
    """Highest amplification of the automatic exposure."""
    full_well: Annotated[float, Field(ge=100, le=1e6)] = 10_000.0
    """Electrons that are white without amplification."""
    read_noise: Annotated[float, Field(ge=0, le=1000)] = 2.5
    """Standard deviation of reading a pixel, electrons."""
    denoising: Annotated[float, Field(ge=0, le=2)] = 0.4
    """Standard deviation of the smoothing for each doubling of the amplification, pixels."""


class AugmentationSettings(Settings):
    """All of the augmentation; a probability of 0 switches its part off.

    Mirroring, late histories, the failures of the picture and those of the lidar are drawn
    independently.
    """

    reliability: ReliabilitySource = "measured"
    """Which the model is given, in training and in evaluation."""
    mirror: Share = 0.5
    """Probability of a row being mirrored, all its modalities."""
    darkness: DarknessSettings = DarknessSettings()
    blur: BlurSettings = BlurSettings()
    cover: CoverSettings = CoverSettings()
    sector_loss: SectorLossSettings = SectorLossSettings()
    thinning: ThinningSettings = ThinningSettings()
    scatter: ScatterSettings = ScatterSettings()
    glare: GlareSettings = GlareSettings()
    droplets: DropletSettings = DropletSettings()
    dust: DustSettings = DustSettings()
    near_leaves: NearLeavesSettings = NearLeavesSettings()
    late_history: LateHistorySettings = LateHistorySettings()
    sensor: ExposureSettings = ExposureSettings()
    laser_scan: LaserScanSettings = LaserScanSettings()
    """As the dataset's: the angle that the scan covers and its least range count here."""
    image_reliability: ImageReliabilitySettings = ImageReliabilitySettings()
    """As the dataset's: r_img of degraded pictures is computed with it."""
    point_reliability: PointReliabilitySettings = PointReliabilitySettings()
    """As the dataset's: r_point of degraded clouds is computed with it."""

    @property
    def lidar_may_fail(self) -> bool:
        """Whether any row's cloud is ever degraded."""
        failures = (self.sector_loss, self.thinning, self.scatter, self.dust, self.near_leaves)
        return any(failure.probability > 0 for failure in failures)


def settings_of_dataset(
    index: DatasetIndex, settings: AugmentationSettings | None = None
) -> AugmentationSettings:
    """Settings of degradations, with the reliabilities and the scan as a dataset computed them.

    Args:
        index: Of the dataset; what its configuration does not say stays as in ``settings``.
        settings: All else; None takes the defaults.

    Raises:
        ZooError: The configuration has numbers that do not fit.
    """
    built = _mapping(index.configuration.get("dataset"))
    found = {key: built.get(key) for key in ("image_reliability", "point_reliability")}
    found["laser_scan"] = _mapping(built.get("points")).get("laser_scan")
    measured = {key: value for key, value in found.items() if value is not None}
    changes = {} if settings is None else settings.model_dump()
    try:
        return validate(changes | measured, AugmentationSettings, f"configuration of {index.name}")
    except ManifestError as error:
        raise ZooError(str(error)) from error


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}
