"""The radiance of lit surfaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.camera.light import Light
from graspe_data.simulation.camera.sky import GROUND_ALBEDO, SUN_TINT, sky_tint
from graspe_data.simulation.camera.texture import Texture
from graspe_data.simulation.ray_scene import Hits, RayScene
from graspe_data.simulation.world.materials import Material

SHADOWS_TO = 40.0
"""Metres from the camera; farther surfaces cast and receive no shadows."""
OPEN_SKY_TO = 1.5
"""Metres above a surface that hide the zenith from it."""
ZENITH_SHARE = 0.5
"""Of the sky's light that comes from about the zenith."""
LIFT = 2e-3
"""Metres from the surface to the start of its shadow ray."""
PRIME = np.uint32(2654435761)
SPREAD = 0.6

Rows = NDArray[np.float32]


class Shading:
    """The radiance of surfaces in a light."""

    def __init__(self, scene: RayScene, materials: Sequence[Material], light: Light) -> None:
        """Take the looks of the materials that indices mean."""
        self._scene, self._light = scene, light
        self._colour = np.array([material.colour for material in materials], np.float32)
        self._through = np.array([material.translucency for material in materials], np.float32)
        self._texture = Texture(materials)
        self._sun = light.sun_direction.astype(np.float32)

    def radiance(self, points: Rows, hits: Hits, pixel_angle: float) -> Rows:
        """Luminance per channel, cd/m^2, float32 (N, 3), of what N rays hit.

        Lambert's law: L = albedo E / pi, with E from the sun where nothing hides it, from the sky
        by how far the surface faces up, and from the ground by how far it faces down. Leaves pass
        their translucency's share of the sun on their other side, in their own colour.

        Args:
            points: float32 (N, 3), where the rays end, metres, world frame.
            hits: What they hit there.
            pixel_angle: Between two pixels, rad.
        """
        footprint = hits.distance * np.float32(pixel_angle)
        factor = self._texture.factor(points, hits.normal, hits.material, footprint)
        albedo = self._colour[hits.material] * (factor * self._by_leaf(hits))[:, None]
        if self._light.sun_lux > 0:
            lit = self._sunlight(points, hits)[:, None] * SUN_TINT + self._skylight(hits)
        else:
            lit = self._skylight(hits) * self._openness(points, hits)[:, None]
        glowing: Rows = albedo * lit * np.float32(1.0 / np.pi)
        return glowing

    def _by_leaf(self, hits: Hits) -> Rows:
        """Every leaf has its own shade; two triangles make one."""
        mixed = (hits.face >> np.uint32(1)) * PRIME
        own = (mixed >> np.uint32(16)).astype(np.float32) * np.float32(1.0 / 65536.0) - 0.5
        leafy = self._through[hits.material] > 0
        shade: Rows = np.where(leafy, 1.0 + np.float32(SPREAD) * own, np.float32(1.0))
        return shade

    def _sunlight(self, points: Rows, hits: Hits) -> Rows:
        cosine = np.einsum("nk,k->n", hits.normal, self._sun)
        strength = np.maximum(cosine, -cosine * self._through[hits.material])
        facing = np.flatnonzero((strength > 0) & (hits.distance < SHADOWS_TO))
        side = np.copysign(np.float32(LIFT), cosine[facing])[:, None] * hits.normal[facing]
        towards = np.broadcast_to(self._sun, side.shape)
        hidden = self._scene.blocked(points[facing] + side, towards)
        strength[facing[hidden]] = 0.0
        lit: Rows = np.maximum(strength, 0.0) * np.float32(self._light.sun_lux)
        return lit

    def _skylight(self, hits: Hits) -> Rows:
        facing_up = 0.5 + 0.5 * hits.normal[:, 2:]
        sky = sky_tint(self._light) * np.float32(self._light.sky_lux)
        ground = np.float32(GROUND_ALBEDO * self._light.level_lux)
        lit: Rows = facing_up * sky + (1.0 - facing_up) * ground
        return lit

    def _openness(self, points: Rows, hits: Hits) -> Rows:
        """The share of the sky's light that what stands overhead leaves, without a sun."""
        up = np.array([0.0, 0.0, 1.0], np.float32)
        near = np.flatnonzero(hits.distance < SHADOWS_TO)
        start = points[near] + np.float32(LIFT) * hits.normal[near]
        hidden = self._scene.blocked(start, np.broadcast_to(up, start.shape), OPEN_SKY_TO)
        open_share = np.ones(len(points), np.float32)
        open_share[near[hidden]] = 1.0 - ZENITH_SHARE
        return open_share
