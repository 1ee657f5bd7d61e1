"""What fails of a picture, and the picture taken so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    """

    light: float = 1.0
    blur_length: float = 0.0
    blur_angle: float = 0.0
    covered: float = 0.0

    @property
    def nothing(self) -> bool:
        """The picture stays as it is."""
        return self.light == 1.0 and self.blur_length == 0.0 and self.covered == 0.0


def retake(
    picture: NDArray[np.uint8],
    failure: PictureFailure,
    sensor: ExposureSettings,
    generator: np.random.Generator,
) -> NDArray[np.uint8]:
    """Take a picture again by a camera that fails.

    The scene is blurred, then covered, since the cover moves with the camera, then darkened; the
    automatic exposure brightens what is left as far as it can, with the noise that goes with it.

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
    if failure.covered > 0:
        seen = cover_lens(seen, failure.covered, generator)
    if failure.light < 1:
        seen = seen * np.float32(failure.light)
    if failure.covered > 0 or failure.light < 1:
        seen = expose(seen, meter(seen, target, sensor.gain_limit), sensor, generator)
    return picture_of(seen)
