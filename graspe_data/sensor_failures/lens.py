"""What deceives a camera at its lens: the sun in its glass, and drops of water on it.

Both act on light, float32 (H, W, 3), linear in any unit; what the exposure makes of it is the
camera's. Lengths are shares of the picture's width, so that all sizes of a picture fail alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Light = NDArray[np.float32]

VEIL, BLOOM, HALO, RAYS = 1.5, 25.0, 3.0, 2.0
"""Light that a glare of strength 1 adds, in means of the picture: everywhere, in the middle of the
bloom, in the middle of the halo, and along the rays."""
BLOOM_SIZE, HALO_SIZE, RAY_SIZE = 0.07, 0.25, 0.5
SUN = (1.0, 0.93, 0.8)
"""Its colour in red, green and blue."""
DROP_RADIUS = (0.025, 0.09)
BENDING = 3.0
"""A drop is a lens of its own: it shows what lies so many times as far to the other side."""
RIM = 0.25
"""Share of a drop's radius over which it fades."""
DIM = 0.85
"""Of the light that comes through a drop."""
MOST_DROPS = 400


def _share(value: float, name: str) -> None:
    if not 0.0 <= value <= 1.0:
        raise ValueError(f"{name}: {value:g} is not in 0..1")


@dataclass(frozen=True)
class Glare:
    """The sun shines into the lens.

    ``strength``: 0..1; of 1 the picture is a bright spot in a veil. ``seed``: of where it stands.
    """

    strength: float
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse a strength that is none."""
        _share(self.strength, "strength of a glare")


@dataclass(frozen=True)
class Droplets:
    """Drops of water on the lens.

    ``share``: of the picture that they cover, 0..1. ``seed``: of where they are.
    """

    share: float
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse a share that is none."""
        _share(self.share, "share of the lens under drops")


def add_glare(light: Light, glare: Glare) -> Light:
    """The light with what the sun scatters in the lens added to it; at strength 0 the same array.

    A veil over all, a bloom and a halo around the sun, and rays from it. The sun stands in the
    upper quarter of the picture or just above.
    """
    if glare.strength == 0:
        return light
    drawn = np.random.default_rng([glare.seed, 11])
    height, width = light.shape[:2]
    u, v = drawn.uniform(0.1, 0.9) * width, drawn.uniform(-0.1, 0.25) * height
    spokes, phase = int(drawn.integers(5, 9)), drawn.uniform(0, 2 * np.pi)
    # Where each pixel lies from the sun, in widths of the picture.
    across = (np.arange(width, dtype=np.float32) - np.float32(u)) / np.float32(width)
    down = (np.arange(height, dtype=np.float32)[:, None] - np.float32(v)) / np.float32(width)
    distance, angle = np.hypot(across, down), np.arctan2(down, across)
    # What is scattered there, in means of the picture.
    spread = VEIL + BLOOM * np.exp(-((distance / BLOOM_SIZE) ** 2))
    spread += HALO / (1 + (distance / HALO_SIZE) ** 2)
    ray = np.maximum(np.cos(spokes * angle + np.float32(phase)), 0) ** 12
    spread += RAYS * ray * np.exp(-distance / RAY_SIZE)
    bright = np.float32(glare.strength * float(light.mean()))
    dazzled: Light = light + bright * spread[..., None] * np.array(SUN, np.float32)
    return dazzled


def through_droplets(light: Light, drops: Droplets) -> Light:
    """The light as it comes through drops on the lens; at a share of 0 the same array.

    A drop so near the lens is out of focus: it shows a wide part of the scene upside down, blurred,
    with a soft rim.
    """
    if drops.share == 0:
        return light
    height, width = light.shape[:2]
    weight, u, v = _bent(drops, height, width)
    blurred = cv2.GaussianBlur(light, (0, 0), max(0.01 * width, 0.5))
    seen = cv2.remap(blurred, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    kept: Light = light + weight[..., None] * (np.float32(DIM) * seen - light)
    return kept


def _bent(drops: Droplets, height: int, width: int) -> tuple[Light, Light, Light]:
    """How much of each pixel is drop, and which column and row is seen there, each (H, W)."""
    drawn = np.random.default_rng([drops.seed, 12])
    row, column = np.mgrid[:height, :width].astype(np.float32)
    weight = np.zeros((height, width), np.float32)
    u, v = column.copy(), row.copy()
    for _ in range(MOST_DROPS):
        if drops.share < 1 and weight.mean() >= drops.share:
            break
        radius = drawn.uniform(*DROP_RADIUS) * width
        x, y = drawn.uniform(0, width), drawn.uniform(0, height)
        right, below = column - np.float32(x), row - np.float32(y)
        inside = (1 - np.hypot(right, below) / np.float32(radius)) / np.float32(RIM)
        own = np.clip(inside, 0, 1)
        newer = own > weight
        u[newer] = (np.float32(x) - np.float32(BENDING) * right)[newer]
        v[newer] = (np.float32(y) - np.float32(BENDING) * below)[newer]
        weight = np.maximum(weight, own)
    return weight, u, v
