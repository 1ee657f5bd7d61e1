"""What ails a sensor for a while: covers that darken or hide, and light and dust that mislead."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from graspe_data.manifest import Settings, Share
from graspe_data.sensor_failures import Droplets, Dust, Glare, NearLeaves
from graspe_data.simulation.camera.lens_cover import LensCover
from graspe_data.simulation.lidar.occlusion import BeforeLidar, SectorOcclusion, ThinnedReturns

SHORTEST_S = 0.1
Pause = Annotated[float, Field(ge=0, le=36_000)]
Spell = Annotated[float, Field(ge=SHORTEST_S, le=36_000)]
Angle = Annotated[float, Field(ge=1e-3, le=2 * np.pi)]


class _Occlusion(Settings):
    every_s: tuple[Pause, Pause]
    """Seconds that the sensor is free between two covers."""
    lasting_s: tuple[Spell, Spell]
    """Seconds that it stays."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in ("every_s", "lasting_s", "share", "width", "strength"):
            low, high = getattr(self, name, (0.0, 0.0))
            if low > high:
                raise ValueError(f"{name}: the low end {low:g} is above the high end {high:g}")
        return self


class CoveredLens(_Occlusion):
    """Mud and leaves on the camera's lens."""

    kind: Literal["lens"]
    share: tuple[Share, Share]
    """Of the picture that is covered."""


class CoveredSector(_Occlusion):
    """A leaf or mud that hides a sector from the lidar."""

    kind: Literal["lidar"]
    width: tuple[Angle, Angle]
    """rad, of the sector; it faces anywhere."""


class GlareOnLens(_Occlusion):
    """The sun shines into the camera's lens."""

    kind: Literal["glare"]
    strength: tuple[Share, Share]
    """1 leaves a bright spot in a veil."""


class DropsOnLens(_Occlusion):
    """Drops of water on the camera's lens."""

    kind: Literal["droplets"]
    share: tuple[Share, Share]
    """Of the picture that they cover."""


class FrozenCamera(_Occlusion):
    """The camera sends the same picture again and again, with stamps that go on."""

    kind: Literal["frozen"]


class DustBeforeLidar(_Occlusion):
    """Dust or rain that returns beams."""

    kind: Literal["dust"]
    strength: tuple[Share, Share]
    """How dense a puff is in its middle."""


class LeavesBeforeLidar(_Occlusion):
    """Leaves half a metre before the lidar."""

    kind: Literal["near_leaves"]
    share: tuple[Share, Share]
    """Of what is ahead that they hide."""


class ThinnedLidar(_Occlusion):
    """Returns too weak to be seen here and there, as through a dirty window."""

    kind: Literal["thinned"]
    share: tuple[Share, Share]
    """Of the returns that are lost."""


Occlusion = Annotated[
    CoveredLens
    | CoveredSector
    | GlareOnLens
    | DropsOnLens
    | FrozenCamera
    | DustBeforeLidar
    | LeavesBeforeLidar
    | ThinnedLidar,
    Field(discriminator="kind"),
]
OnLens = LensCover | Glare | Droplets


@dataclass(frozen=True)
class Covers:
    """What ails the sensors and when; seconds since the drive's start, in order of time."""

    lens: tuple[tuple[float, float, OnLens], ...] = ()
    lidar: tuple[tuple[float, float, BeforeLidar], ...] = ()
    frozen: tuple[tuple[float, float], ...] = ()

    def on_lens(self, time_s: float) -> OnLens | None:
        """What is on the lens at a time; of several the first declared."""
        held = (cover for start, stop, cover in self.lens if start <= time_s < stop)
        return next(held, None)

    def on_lidar(self, time_s: float) -> BeforeLidar | None:
        """What is before the lidar at a time; of several the first declared."""
        held = (cover for start, stop, cover in self.lidar if start <= time_s < stop)
        return next(held, None)

    def frozen_since(self, time_s: float) -> float | None:
        """Since when the camera has sent one picture; None where it works."""
        return next((start for start, stop in self.frozen if start <= time_s < stop), None)


def draw_covers(
    occlusions: Sequence[Occlusion], duration_s: float, generator: np.random.Generator
) -> Covers:
    """Draw when the sensors are ailing, and of what, all uniformly within their ranges."""
    lens: list[tuple[float, float, OnLens]] = []
    lidar: list[tuple[float, float, BeforeLidar]] = []
    frozen: list[tuple[float, float]] = []
    for occlusion in occlusions:
        for start, stop in _spells(occlusion, duration_s, generator):
            if isinstance(occlusion, FrozenCamera):
                frozen.append((start, stop))
            elif isinstance(occlusion, CoveredLens | GlareOnLens | DropsOnLens):
                lens.append((start, stop, _on_lens(occlusion, generator)))
            else:
                lidar.append((start, stop, _before_lidar(occlusion, generator)))
    return Covers(tuple(lens), tuple(lidar), tuple(frozen))


def _spells(
    occlusion: _Occlusion, duration_s: float, generator: np.random.Generator
) -> Iterator[tuple[float, float]]:
    start = float(generator.uniform(*occlusion.every_s))
    while start < duration_s:
        stop = start + float(generator.uniform(*occlusion.lasting_s))
        yield start, stop
        start = stop + float(generator.uniform(*occlusion.every_s))


def _on_lens(
    occlusion: CoveredLens | GlareOnLens | DropsOnLens, generator: np.random.Generator
) -> OnLens:
    if isinstance(occlusion, GlareOnLens):
        return Glare(float(generator.uniform(*occlusion.strength)), _seed(generator))
    share = float(generator.uniform(*occlusion.share))
    made = LensCover if isinstance(occlusion, CoveredLens) else Droplets
    return made(share, _seed(generator))


def _before_lidar(
    occlusion: CoveredSector | DustBeforeLidar | LeavesBeforeLidar | ThinnedLidar,
    generator: np.random.Generator,
) -> BeforeLidar:
    if isinstance(occlusion, CoveredSector):
        return _sector(occlusion, generator)
    if isinstance(occlusion, DustBeforeLidar):
        return Dust(float(generator.uniform(*occlusion.strength)), _seed(generator))
    share = float(generator.uniform(*occlusion.share))
    made = NearLeaves if isinstance(occlusion, LeavesBeforeLidar) else ThinnedReturns
    return made(share, _seed(generator))


def _seed(generator: np.random.Generator) -> int:
    return int(generator.integers(2**31))


def _sector(occlusion: CoveredSector, generator: np.random.Generator) -> SectorOcclusion:
    start = float(generator.uniform(-np.pi, np.pi))
    return SectorOcclusion(start, start + float(generator.uniform(*occlusion.width)))
