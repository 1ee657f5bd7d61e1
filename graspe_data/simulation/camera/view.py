"""What rays of a camera see: surfaces, glass, sky and haze."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.camera.light import Light
from graspe_data.simulation.camera.shading import Shading
from graspe_data.simulation.camera.sky import GROUND_ALBEDO, sky_radiance
from graspe_data.simulation.ray_scene import NOTHING, Hits, RayScene
from graspe_data.simulation.world.world import World

PANES = 3
"""Looked through; the last one is opaque to what is behind."""
HAZE = 1.0 / 600.0
"""Share of the light lost in a metre of air."""
GLASS_REFLECTS = 0.08
"""At normal incidence, both faces of a pane (4 % each at an index of 1.5)."""
WATER_REFLECTS = 0.02
"""At normal incidence, at an index of 1.33."""
STEP = 1e-3

Rows = NDArray[np.float32]


@dataclass(frozen=True)
class Seen:
    """What N rays see: ``radiance`` float32 (N, 3) in cd/m^2 per channel; ``distance`` (N,).

    The distance in metres is that of the surface behind glass, inf for the sky.
    """

    radiance: Rows
    distance: Rows


class View:
    """Follows a camera's rays through a world in a light."""

    def __init__(self, world: World, scene: RayScene, light: Light) -> None:
        """Prepare the materials; ``scene`` holds the world's surfaces."""
        self._scene, self._light = scene, light
        self._shading = Shading(scene, world.materials, light)
        through = [material.transmission for material in world.materials]
        self._through = np.zeros(NOTHING + 1, np.float32)
        self._through[: len(through)] = through
        self._gloss = np.zeros(NOTHING + 1, np.float32)
        for index in np.unique(world.surfaces.material):
            self._gloss[index] = world.materials[index].gloss

    def look(self, origin: Rows, directions: Rows, near: float, pixel_angle: float) -> Seen:
        """Follow rays from one place.

        Args:
            origin: float32 (3,), metres, world frame.
            directions: float32 (N, 3), unit, world frame.
            near: Surfaces nearer than this are passed, metres.
            pixel_angle: Between two pixels, rad.
        """
        hits = self._cast(origin + np.float32(near) * directions, directions, np.float32(near))
        radiance = self._radiance(origin, directions, hits, pixel_angle)
        distance, left = hits.distance.copy(), np.ones(len(directions), np.float32)
        glass = np.flatnonzero(self._through[hits.material])
        hits = _only(hits, glass)
        for _ in range(PANES):
            if len(glass) == 0:
                break
            ahead = directions[glass]
            passed = self._pass_pane(ahead, hits)
            left[glass] *= passed
            start = distance[glass] + np.float32(STEP)
            hits = self._cast(origin + start[:, None] * ahead, ahead, start)
            behind = self._radiance(origin, ahead, hits, pixel_angle)
            radiance[glass] += left[glass, None] * behind
            distance[glass] = hits.distance
            again = self._through[hits.material] > 0
            glass, hits = glass[again], _only(hits, again)
        return Seen(radiance, distance)

    def _cast(self, start: Rows, directions: Rows, before: Rows | np.float32) -> Hits:
        hits = self._scene.cast(start, directions)
        return replace(hits, distance=hits.distance + before)

    def _radiance(self, origin: Rows, directions: Rows, hits: Hits, pixel_angle: float) -> Rows:
        """Of the sky where nothing is hit; of a pane what it mirrors of the sky."""
        radiance = np.empty((len(directions), 3), np.float32)
        free = hits.material == NOTHING
        radiance[free] = sky_radiance(directions[free], self._light)
        pane = self._through[hits.material] > 0
        if pane.any():
            radiance[pane] = self._mirrored(directions[pane], hits.normal[pane])
        solid = np.flatnonzero(~(free | pane))
        ahead, met = directions[solid], _only(hits, solid)
        points = origin + ahead * met.distance[:, None]
        shown = self._shading.radiance(points, met, pixel_angle)
        if self._gloss.any():
            self._add_gloss(shown, ahead, met)
        radiance[solid] = self._hazy(shown, met.distance)
        return radiance

    def _hazy(self, radiance: Rows, distance: Rows) -> Rows:
        """Koschmieder's law: L exp(-b d) + L_air (1 - exp(-b d))."""
        if self._light.sky == "indoor":
            return radiance
        clear = np.exp(distance * np.float32(-HAZE))[:, None]
        air = np.float32(0.5 * self._light.level_lux / np.pi)
        faded: Rows = radiance * clear + air * (1.0 - clear)
        return faded

    def _add_gloss(self, radiance: Rows, directions: Rows, hits: Hits) -> None:
        """What is wet mirrors the sky; what stands between the two is left out."""
        wet = np.flatnonzero(self._gloss[hits.material])
        mirrored = self._mirrored(directions[wet], hits.normal[wet], WATER_REFLECTS)
        radiance[wet] += self._gloss[hits.material[wet], None] * mirrored

    def _pass_pane(self, directions: Rows, hits: Hits) -> Rows:
        passed: Rows = self._through[hits.material] * (
            1.0 - _mirror_share(directions, hits.normal, GLASS_REFLECTS)
        )
        return passed

    def _mirrored(self, directions: Rows, normals: Rows, squarely: float = GLASS_REFLECTS) -> Rows:
        along = np.einsum("nk,nk->n", directions, normals)[:, None]
        share = _mirror_share(directions, normals, squarely)
        outward = directions - 2.0 * along * normals
        if self._light.sky == "indoor":
            dim = np.float32(GROUND_ALBEDO * self._light.level_lux / np.pi)
            return np.repeat(share[:, None] * dim, 3, axis=1)
        outward[:, 2] = np.abs(outward[:, 2])
        return share[:, None] * sky_radiance(outward, self._light)


def _mirror_share(directions: Rows, normals: Rows, squarely: float) -> Rows:
    """Fresnel's reflectance by Schlick 1994: R0 + (1 - R0) (1 - cos)^5."""
    cosine = np.abs(np.einsum("nk,nk->n", directions, normals))
    share: Rows = np.float32(squarely) + np.float32(1.0 - squarely) * (1 - cosine) ** 5
    return share


def _only(hits: Hits, kept: NDArray[np.intp] | NDArray[np.bool_]) -> Hits:
    return Hits(hits.distance[kept], hits.normal[kept], hits.material[kept], hits.face[kept])
