"""What comes back of the rays of a beam: ranges and energies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.ray_scene import NOTHING, RayScene
from graspe_data.simulation.world.materials import Material

FAR: Final = 1e6
"""Range of a ray that meets nothing, metres; its energy is 0."""
PANES: Final = 3
"""Panes of glass that a ray is followed through."""
GLINT: Final = float(np.radians(4.0))
"""Half width of the mirror-like lobe of glass, rad."""
_FAINTEST_GLINT: Final = 1e-4
_STEP: Final = 1e-3
_NO_GLINTS: Final = (np.empty(0, np.intp), np.empty(0, np.float32), np.empty(0, np.float32))

Floats32 = NDArray[np.float32]


@dataclass(frozen=True)
class Echoes:
    """Echoes of R rays: ``distance`` in metres and ``energy``, float32 (R,), share of the full.

    ``glint_ray`` intp (G,), ``glint_distance`` and ``glint_energy`` (G,): those of panes that the
    rays then went through.
    """

    distance: Floats32
    energy: Floats32
    glint_ray: NDArray[np.intp]
    glint_distance: Floats32
    glint_energy: Floats32


class Surfaces:
    """A scene and how its materials reflect."""

    def __init__(self, scene: RayScene, materials: Sequence[Material]) -> None:
        """Take the materials that the scene's indices mean."""
        self._scene = scene
        self._reflectivity = _table([material.reflectivity for material in materials])
        self._transmission = _table([material.transmission for material in materials])

    def echoes(self, origins: Floats32, directions: Floats32, panes: int = PANES) -> Echoes:
        """Send rays, origins and unit directions float32 (R, 3).

        A rough surface returns reflectivity cos(incidence) (Lambert). Glass returns
        reflectivity exp(-(incidence / 4 degrees)^2) and passes its transmission on, each way; what
        is behind more than ``panes`` of them is not seen.
        """
        hits = self._scene.cast(origins, directions)
        # Lambert: what comes back falls with the cosine of the incidence.
        cosine = np.maximum(-np.einsum("rk,rk->r", hits.normal, directions), 0)
        distance = np.minimum(hits.distance, np.float32(FAR))
        energy = self._reflectivity[hits.material] * cosine
        glass = np.flatnonzero(self._transmission[hits.material] > 0)
        seen = Echoes(distance, energy, *_NO_GLINTS)
        if not len(glass):
            return seen
        # A pane glints near normal incidence, and passes the rest on to what is behind, there and
        # back.
        own = self._reflectivity[hits.material[glass]] * _lobe(cosine[glass])
        energy[glass] = 0
        if panes == 0:
            return seen
        start = distance[glass] + np.float32(_STEP)
        ahead = directions[glass]
        behind = self.echoes(origins[glass] + start[:, None] * ahead, ahead, panes - 1)
        passed = np.square(self._transmission[hits.material[glass]])
        return _with_glass(seen, glass, own, start, passed, behind)


def _with_glass(
    seen: Echoes,
    glass: NDArray[np.intp],
    own: Floats32,
    start: Floats32,
    passed: Floats32,
    behind: Echoes,
) -> Echoes:
    """Put what is behind panes, from ``start`` on, in the place of the panes."""
    distance, energy = seen.distance, seen.energy
    bright = np.flatnonzero(own > _FAINTEST_GLINT)
    inner = behind.glint_ray
    rays = [glass[bright], glass[inner]]
    ranges = [distance[glass[bright]], start[inner] + behind.glint_distance]
    strengths = [own[bright], passed[inner] * behind.glint_energy]
    distance[glass] = np.minimum(start + behind.distance, np.float32(FAR))
    energy[glass] = passed * behind.energy
    glints = (np.concatenate(part) for part in (rays, ranges, strengths))
    return Echoes(distance, energy, *glints)


def _table(values: Sequence[float]) -> Floats32:
    table = np.zeros(NOTHING + 1, np.float32)
    table[: len(values)] = values
    return table


def _lobe(cosine: Floats32) -> Floats32:
    incidence = np.arccos(np.minimum(cosine, 1))
    lobe: Floats32 = np.exp(-np.square(incidence / np.float32(GLINT)))
    return lobe
