"""What a simulated camera is like: picture, mounting, exposure and sensor."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from graspe_data.manifest import Settings
from graspe_data.robot import Mounting


class CameraSettings(Settings):
    """A pinhole camera with a global shutter and automatic exposure."""

    width: Annotated[int, Field(ge=16, le=4096)] = 320
    """Pixels."""
    height: Annotated[int, Field(ge=16, le=4096)] = 240
    """Pixels."""
    rate: Annotated[float, Field(ge=0.01, le=100)] = 5.0
    """Pictures in a second, Hz."""
    field_of_view: Annotated[float, Field(ge=0.2, le=2.6)] = 1.17
    """From the left edge to the right, rad."""
    mounting: Mounting = Mounting(translation=(0.45, 0.0, 0.15), rotation_rpy=(0.0, 0.45, 0.0))
    """The body in base_link, m and rad; it looks along its x, so positive pitch looks down."""
    near: Annotated[float, Field(ge=0, le=1)] = 0.08
    """Surfaces nearer than this are passed, m."""
    exposure_limit: Annotated[float, Field(gt=0, le=1)] = 0.033
    """Longest exposure, s."""
    gain_limit: Annotated[float, Field(ge=1, le=256)] = 8.0
    """Highest amplification."""
    target_grey: Annotated[float, Field(gt=0, lt=1)] = 0.18
    """Mean of the linear picture that the automatic exposure aims at, 1 = white."""
    highlights: Annotated[float, Field(ge=0, le=1)] = 0.01
    """Share of the picture that the automatic exposure lets grow whiter than white."""
    f_number: Annotated[float, Field(ge=0.7, le=32)] = 2.0
    """Focal length over aperture."""
    sensitivity: Annotated[float, Field(gt=0, le=1e6)] = 10_000.0
    """Electrons of a pixel per lux second on the sensor."""
    full_well: Annotated[float, Field(ge=100, le=1e6)] = 10_000.0
    """Electrons that are white at a gain of 1."""
    read_noise: Annotated[float, Field(ge=0, le=1000)] = 2.5
    """Standard deviation of reading a pixel, electrons."""
    denoising: Annotated[float, Field(ge=0, le=2)] = 0.4
    """Standard deviation of the smoothing for each doubling of the gain, pixels."""
    softness: Annotated[float, Field(ge=0, le=5)] = 0.6
    """Standard deviation of the lens's blur, pixels."""
    vibration: Annotated[float, Field(ge=0, le=10)] = 0.03
    """Standard deviation of the shake about each axis, rad/s."""
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 90
    """Of the encoder, percent."""
