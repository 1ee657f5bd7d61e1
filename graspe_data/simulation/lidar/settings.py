"""What a simulated lidar is like: a VLP-16 with its mounting, beam and receiver."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from graspe_data.manifest import Settings, Share
from graspe_data.robot import Mounting

Returns = Literal["strongest", "last", "dual"]


class LidarSettings(Settings):
    """A VLP-16; figures of its data sheet (63-9229) and manual (63-9243) where they give them."""

    model: Literal["VLP-16"] = "VLP-16"
    """16 rings at -15 to 15 degrees, one laser every 2.304 us, all of them every 55.296 us."""
    rate: Annotated[float, Field(ge=0.01, le=20)] = 5.0
    """Clouds published in a second, Hz; the rotation rate or a whole fraction of it."""
    rotation_rate: Annotated[float, Field(ge=5, le=20)] = 10.0
    """Turns in a second, Hz."""
    mounting: Mounting = Mounting(translation=(0.2, 0.0, 0.35))
    """The sensor in base_link, m and rad."""
    sub_rays: Annotated[int, Field(ge=1, le=9)] = 5
    """Rays that stand for a beam."""
    divergence: Annotated[float, Field(ge=0, le=0.02)] = 3e-3
    """Full angle of a beam's cone, rad."""
    range_noise: Annotated[float, Field(ge=0, le=1)] = 0.01
    """Standard deviation of a range, m."""
    intensity_noise: Annotated[float, Field(ge=0, le=128)] = 2.0
    """Standard deviation of an intensity, counts of 255."""
    pulse_length: Annotated[float, Field(ge=0, le=10)] = 0.3
    """Returns of one beam less than this behind one another come back as one, m."""
    returns: Returns = "strongest"
    """Which returns of a beam are published."""
    minimum_range: Annotated[float, Field(ge=0, le=10)] = 0.4
    """Nearer returns are not published, m."""
    maximum_range: Annotated[float, Field(gt=0, le=300)] = 100.0
    """Farther returns are not published, m."""
    faintest_share: Share = 0.1
    """Share of the full energy that is just detected at 50 m; in proportion to the range squared
    elsewhere."""
    dropout: Share = 0.3
    """Share of the returns at the limit of detection that are lost; twice the energy halves it."""
    motion_distortion: bool = True
    """The robot moves on while the sensor turns."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        turns = self.rotation_rate / self.rate
        if turns < 1 - 1e-9 or abs(turns - round(turns)) > 1e-9:  # noqa: PLR2004
            raise ValueError(
                f"rate: {self.rate:g} Hz is no whole fraction of the rotation rate of "
                f"{self.rotation_rate:g} Hz; expected it, its half, its third and so on"
            )
        if self.minimum_range >= self.maximum_range:
            raise ValueError(
                f"minimum_range: {self.minimum_range:g} m is not below the maximum_range of "
                f"{self.maximum_range:g} m; lower it or raise the other"
            )
        return self
