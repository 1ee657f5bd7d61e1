"""The light of a drive: sun and sky."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings

Sky = Literal["clear", "overcast", "indoor"]
Lux = Annotated[float, Field(gt=0, le=200_000)]
Elevation = Annotated[float, Field(ge=0.02, le=np.pi / 2)]
Azimuth = Annotated[float, Field(ge=-2 * np.pi, le=2 * np.pi)]


class LightSettings(Settings):
    """What the light of a drive is drawn from, uniformly; illuminance by its logarithm."""

    illuminance_lux: tuple[Lux, Lux] = (20_000.0, 80_000.0)
    """On level open ground, lux: day 2e4-8e4, overcast 5e3-2e4, dusk 5-50, night 0.3-2."""
    sun_elevation: tuple[Elevation, Elevation] = (0.5, 1.2)
    """Above the horizon, rad; counts under a clear sky."""
    sun_azimuth: tuple[Azimuth, Azimuth] = (-np.pi, np.pi)
    """About z from the world's x, rad."""
    sky: Sky = "clear"
    """Clear has a sun and shadows; overcast has none; indoor is lit evenly from above."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in ("illuminance_lux", "sun_elevation", "sun_azimuth"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: the low end {low:g} is above the high end {high:g}")
        return self


@dataclass(frozen=True)
class Light:
    """Sun and sky.

    ``sun_direction``: float64 (3,), unit, world frame, towards the sun. ``sun_lux``: illuminance
    of a surface that faces the sun squarely. ``sky_lux``: of level ground by the sky alone.
    """

    sky: Sky
    sun_direction: Floats
    sun_lux: float
    sky_lux: float

    @property
    def level_lux(self) -> float:
        """Illuminance of level open ground."""
        return self.sky_lux + self.sun_lux * max(0.0, float(self.sun_direction[2]))


def draw_light(settings: LightSettings, generator: np.random.Generator) -> Light:
    """Draw sun and sky; their illuminance of level ground is what was drawn.

    Under a clear sky it is shared as sun and sky share it in the IES daylight model (IES Lighting
    Handbook, daylight availability): 127.5 exp(-0.21 / sin e) sin e klx to 0.8 + 15.5 sqrt(sin e)
    klx at a sun elevation of e.
    """
    lux = float(np.exp(generator.uniform(*np.log(settings.illuminance_lux))))
    elevation = float(generator.uniform(*settings.sun_elevation))
    azimuth = float(generator.uniform(*settings.sun_azimuth))
    level, rise = np.cos(elevation), np.sin(elevation)
    towards = np.array([level * np.cos(azimuth), level * np.sin(azimuth), rise])
    if settings.sky != "clear":
        return Light(settings.sky, towards, 0.0, lux)
    sun, sky = 127.5 * np.exp(-0.21 / rise) * rise, 0.8 + 15.5 * np.sqrt(rise)
    share = float(sun / (sun + sky))
    return Light(settings.sky, towards, lux * share / float(rise), lux * (1.0 - share))
