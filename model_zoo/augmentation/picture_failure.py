"""What fails of a picture, and the picture taken so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.sensor_failures import Droplets, Glare, add_glare, through_droplets
from model_zoo.augmentation.camera import expose, light_of, meter, motion_blur, picture_of
from model_zoo.augmentation.cover import cover_lens
from model_zoo.augmentation.settings import ExposureSettings


@dataclass(frozen=True)
class PictureFailure:
    """What happens to the camera of one row; as made without arguments, nothing.

    Attributes:
        light: Left of the scene's light, above 0 to 1.
        blur_length: Pixels that everything moves during the exposure.
        blur_angle: Between that motion and the picture's rows, rad.
        covered: Share of the lens that is covered, 0..1.
        droplets: Share of the lens under drops of water, 0..1.
        glare: Strength of the sun in the lens, 0..1.
    """

    light: float = 1.0
    blur_length: float = 0.0
    blur_angle: float = 0.0
    covered: float = 0.0
    droplets: float = 0.0
    glare: float = 0.0

    @property
    def nothing(self) -> bool:
        """The picture stays as it is."""
        return self == PictureFailure(blur_angle=self.blur_angle)


def retake(
    picture: NDArray[np.uint8],
    failure: PictureFailure,
    sensor: ExposureSettings,
    generator: np.random.Generator,
) -> NDArray[np.uint8]:
    """Take a picture again by a camera that fails.

    The scene is blurred, then seen through drops and covers, which move with the camera, then
    darkened; the automatic exposure brightens what is left as far as it can, with the noise that
    goes with it, and exposes the shorter the more light a glare adds.

    Args:
        picture: uint8 (H, W, 3), sRGB, taken to be well exposed.
        failure: What happens.
        sensor: The camera.
        generator: Draws the cover and the noise.
    """
    seen = light_of(picture)
    target = float(seen.mean())
    if failure.blur_length > 0:
        seen = motion_blur(seen, failure.blur_length, failure.blur_angle)
    if failure.droplets > 0:
        seen = through_droplets(seen, Droplets(failure.droplets, _seed(generator)))
    if failure.covered > 0:
        seen = cover_lens(seen, failure.covered, generator)
    if failure.light < 1:
        seen = seen * np.float32(failure.light)
    if failure.glare > 0:
        seen = add_glare(seen, Glare(failure.glare, _seed(generator)))
        seen = seen * np.float32(min(1.0, target / max(float(seen.mean()), 1e-9)))
    if failure.covered > 0 or failure.light < 1:
        seen = expose(seen, meter(seen, target, sensor.gain_limit), sensor, generator)
    return picture_of(seen)


def _seed(generator: np.random.Generator) -> int:
    return int(generator.integers(2**31))
