"""A beam of finite width as a few rays."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

_LEAST_WITH_CENTRE: Final = 5
_GOLDEN_ANGLE: Final = np.pi * (3.0 - np.sqrt(5.0))


def sub_rays(directions: NDArray[np.float64], divergence: float, count: int) -> NDArray[np.float32]:
    """Spread beams into rays of equal weight.

    The rays lie on a ring, from five on with one in the middle, whose mean square radius is that
    of an evenly lit disc, R^2 / 2 with R = divergence / 2. The ring is turned from beam to beam.

    Args:
        directions: (N, 3), unit, of the beams' axes; none is vertical.
        divergence: Full angle of the cone, rad.
        count: Rays in a beam.

    Returns:
        float32 (N, count, 3), unit.
    """
    across, along = _pattern(len(directions), count)
    aside = np.stack(
        [-directions[:, 1], directions[:, 0], np.zeros(len(directions))], axis=1
    ) / np.hypot(directions[:, :1], directions[:, 1:2])
    upward = np.cross(directions, aside)
    half = divergence / 2
    rays = directions[:, None] + half * (
        across[..., None] * aside[:, None] + along[..., None] * upward[:, None]
    )
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    return rays.astype(np.float32)


def _pattern(beams: int, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Offsets in a disc of radius 1, each (beams, count)."""
    if count == 1:
        return np.zeros((beams, 1)), np.zeros((beams, 1))
    ringed = count if count < _LEAST_WITH_CENTRE else count - 1
    radius = np.zeros(count)
    radius[count - ringed :] = np.sqrt(count / (2 * ringed))
    angle = np.arange(count) * (2 * np.pi / ringed) + _GOLDEN_ANGLE * np.arange(beams)[:, None]
    return radius * np.cos(angle), radius * np.sin(angle)
