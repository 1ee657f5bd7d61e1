"""The receiver: which returns of a turn's beams are reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.lidar.echoes import FAR, Echoes
from graspe_data.simulation.lidar.returns import choose_returns, least_energy, merge_echoes
from graspe_data.simulation.lidar.settings import LidarSettings

Floats32 = NDArray[np.float32]


@dataclass(frozen=True)
class BeamReturns:
    """R returns in the order of their beams.

    ``beam`` intp (R,), rising; ``distance`` (R,), metres; ``energy`` (R,), share of the full.
    """

    beam: NDArray[np.intp]
    distance: Floats
    energy: Floats

    def where(self, kept: NDArray[Any]) -> BeamReturns:
        """Those kept, bool (R,)."""
        return BeamReturns(self.beam[kept], self.distance[kept], self.energy[kept])


def receive(echoes: Echoes, settings: LidarSettings, generator: np.random.Generator) -> BeamReturns:
    """Merge the echoes of each beam, and report what is detected.

    Args:
        echoes: Of the rays of all beams, ``sub_rays`` to a beam.
        settings: The receiver's.
        generator: Draws which weak returns are lost.
    """
    share = np.float32(1 / settings.sub_rays)
    distance = echoes.distance.reshape(-1, settings.sub_rays)
    energy = (share * echoes.energy).reshape(distance.shape)
    away, strength = _reported(distance, energy, settings)
    if len(echoes.glint_ray):
        beams, wide, strong = _beside_glints(distance, energy, echoes, share)
        away[beams], strength[beams] = _reported(wide, strong, settings)
    beam, number = np.nonzero(strength)
    found = BeamReturns(beam, away[beam, number], strength[beam, number])
    risk = settings.dropout * least_energy(found.distance, settings) / found.energy
    return found.where(generator.random(len(beam)) >= risk)


def _reported(
    distance: Floats32, energy: Floats32, settings: LidarSettings
) -> tuple[Floats, Floats]:
    """Range and energy of each beam's returns, (N, 1 or 2); energy 0 for none."""
    away, merged = merge_echoes(distance, energy, settings.pulse_length)
    merged[merged < least_energy(away, settings)] = 0
    chosen, present = choose_returns(merged, settings.returns)
    strength = np.take_along_axis(merged, chosen, axis=1)
    return np.take_along_axis(away, chosen, axis=1), np.where(present, strength, 0)


def _beside_glints(
    distance: Floats32, energy: Floats32, echoes: Echoes, share: np.float32
) -> tuple[NDArray[np.intp], Floats32, Floats32]:
    """The beams that panes glint in, and their echoes, (B, K + G), glints included."""
    order = np.argsort(echoes.glint_ray, kind="stable")
    beam = echoes.glint_ray[order] // distance.shape[1]
    beams, first, row = np.unique(beam, return_index=True, return_inverse=True)
    slot = np.arange(len(beam)) - first[row]
    glints = np.full((len(beams), slot.max() + 1), FAR, np.float32)
    strengths = np.zeros_like(glints)
    glints[row, slot] = echoes.glint_distance[order]
    strengths[row, slot] = share * echoes.glint_energy[order]
    return beams, np.hstack([distance[beams], glints]), np.hstack([energy[beams], strengths])
