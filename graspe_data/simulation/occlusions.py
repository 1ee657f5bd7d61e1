"""Things that cover a sensor for a while: mud and leaves on the lens, a leaf before the lidar."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from graspe_data.manifest import Settings, Share
from graspe_data.simulation.camera.lens_cover import LensCover
from graspe_data.simulation.lidar.occlusion import SectorOcclusion

SHORTEST_S = 0.1
Pause = Annotated[float, Field(ge=0, le=36_000)]
Spell = Annotated[float, Field(ge=SHORTEST_S, le=36_000)]
Angle = Annotated[float, Field(ge=1e-3, le=2 * np.pi)]


class _Occlusion(Settings):
    every_s: tuple[Pause, Pause]
    """Seconds that the sensor is free between two covers."""
    lasting_s: tuple[Spell, Spell]
    """Seconds that a cover stays."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in ("every_s", "lasting_s", "share", "width"):
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


Occlusion = Annotated[CoveredLens | CoveredSector, Field(discriminator="kind")]


@dataclass(frozen=True)
class Covers:
    """What covers the sensors and when; seconds since the drive's start, in order of time."""

    lens: tuple[tuple[float, float, LensCover], ...] = ()
    lidar: tuple[tuple[float, float, SectorOcclusion], ...] = ()

    def on_lens(self, time_s: float) -> LensCover | None:
        """What covers the lens at a time; of several the first declared."""
        held = (cover for start, stop, cover in self.lens if start <= time_s < stop)
        return next(held, None)

    def on_lidar(self, time_s: float) -> SectorOcclusion | None:
        """What covers the lidar at a time; of several the first declared."""
        held = (cover for start, stop, cover in self.lidar if start <= time_s < stop)
        return next(held, None)


def draw_covers(
    occlusions: Sequence[Occlusion], duration_s: float, generator: np.random.Generator
) -> Covers:
    """Draw when the sensors are covered, and by what, all uniformly within their ranges."""
    lens: list[tuple[float, float, LensCover]] = []
    lidar: list[tuple[float, float, SectorOcclusion]] = []
    for occlusion in occlusions:
        for start, stop in _spells(occlusion, duration_s, generator):
            if isinstance(occlusion, CoveredLens):
                share = float(generator.uniform(*occlusion.share))
                lens.append((start, stop, LensCover(share, int(generator.integers(2**31)))))
            else:
                lidar.append((start, stop, _sector(occlusion, generator)))
    return Covers(tuple(lens), tuple(lidar))


def _spells(
    occlusion: CoveredLens | CoveredSector, duration_s: float, generator: np.random.Generator
) -> Iterator[tuple[float, float]]:
    start = float(generator.uniform(*occlusion.every_s))
    while start < duration_s:
        stop = start + float(generator.uniform(*occlusion.lasting_s))
        yield start, stop
        start = stop + float(generator.uniform(*occlusion.every_s))


def _sector(occlusion: CoveredSector, generator: np.random.Generator) -> SectorOcclusion:
    start = float(generator.uniform(-np.pi, np.pi))
    return SectorOcclusion(start, start + float(generator.uniform(*occlusion.width)))
