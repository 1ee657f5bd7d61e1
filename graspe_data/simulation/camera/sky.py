"""The radiance of the sky."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.camera.light import Light, Sky

SUN_TINT = np.array([1.04, 1.0, 0.93], np.float32)
TINTS: dict[Sky, tuple[float, float, float]] = {
    "clear": (0.90, 0.98, 1.14),
    "overcast": (0.98, 1.0, 1.04),
    "indoor": (1.02, 1.0, 0.95),
}
BLUE = np.array([0.62, 0.92, 1.45], np.float32)
"""Of a clear sky between the clouds; its light as a whole is whiter."""
GROUND_ALBEDO = 0.15
RISE = 1.5
CLOUDS = ((0.9, 0.5), (0.35, 0.3), (0.12, 0.2))
"""Widths as a share of the clouds' height, and how much of their thickness each makes."""


def sky_tint(light: Light) -> NDArray[np.float32]:
    """The sky's colour, float32 (3,), luminance about 1."""
    return np.array(TINTS[light.sky], np.float32)


def sky_radiance(directions: NDArray[np.float32], light: Light) -> NDArray[np.float32]:
    """Luminance per channel, cd/m^2, float32 (N, 3), along unit directions in the world (N, 3).

    With z the sine of the elevation: overcast L = 3 E (1 + 2 z) / (7 pi) (Moon and Spencer
    1942), clear L proportional to 1 + 1.5 (1 - z)^2, indoor even; each such that the illuminance
    of level ground is E = ``sky_lux`` before clouds. Below the horizon the ground's haze.
    """
    z = directions[:, 2]
    up = np.maximum(z, 0.0)
    level = _by_elevation(up, light) * np.float32(light.sky_lux / np.pi)
    level[z < 0] = GROUND_ALBEDO * light.level_lux / np.pi
    tint = sky_tint(light)
    if light.sky == "indoor":
        return level[:, None] * tint
    cloud = clouds(directions)[:, None]
    blue = tint if light.sky == "overcast" else BLUE + (1.0 - up[:, None]) ** 6 * (1.0 - BLUE)
    white = 1.15 if light.sky == "overcast" else 1.6
    shining = level[:, None] * (blue + cloud * (white - blue))
    return np.asarray(shining + _glow(directions, light)[:, None] * SUN_TINT, np.float32)


def clouds(directions: NDArray[np.float32]) -> NDArray[np.float32]:
    """How thick soft clouds stand in each direction, 0..1, float32 (N,); none at the horizon."""
    up = np.maximum(directions[:, 2], 0.0)
    x, y = directions[:, 0] / (up + 0.12), directions[:, 1] / (up + 0.12)
    thick: NDArray[np.float32] = np.zeros(len(directions), np.float32)
    for width, amplitude in CLOUDS:
        a, b = np.float32(1.0 / width), np.float32(0.37 / width)
        thick += (
            np.float32(amplitude)
            * np.sin(x * a + np.float32(1.7) * np.sin(y * b))
            * np.sin(y * a - x * b)
        )
    soft = np.clip(thick, 0.0, 1.0) * np.clip(8.0 * up, 0.0, 1.0)
    return np.asarray(soft, np.float32)


def _by_elevation(up: NDArray[np.float32], light: Light) -> NDArray[np.float32]:
    if light.sky == "overcast":
        return np.float32(3.0 / 7.0) * (1.0 + 2.0 * up)
    if light.sky == "indoor":
        return np.ones_like(up)
    # The integral of (1 + a (1 - z)^2) z over the hemisphere is pi (1 + a / 6).
    return (1.0 + RISE * (1.0 - up) ** 2) / np.float32(1.0 + RISE / 6.0)


def _glow(directions: NDArray[np.float32], light: Light) -> NDArray[np.float32]:
    """The sun's disc and the glow about it."""
    if light.sun_lux <= 0:
        return np.zeros(len(directions), np.float32)
    towards_sun = light.sun_direction.astype(np.float32)
    near = np.maximum(np.einsum("nk,k->n", directions, towards_sun), 0.0)
    above = directions[:, 2] > 0
    shine = (0.15 * near**64 + 8.0 * near**2048) * above
    return np.asarray(shine * np.float32(light.sun_lux / np.pi), np.float32)
