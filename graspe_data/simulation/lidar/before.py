"""What comes between a lidar and what its beams would have met."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from graspe_data.sensor_failures import NearLeaves, meet_dust, meet_leaves
from graspe_data.simulation.lidar.beams import Firings
from graspe_data.simulation.lidar.occlusion import BeforeLidar, SectorOcclusion, ThinnedReturns
from graspe_data.simulation.lidar.receiver import BeamReturns

ENERGY = 0.45
"""Share of the full that a leaf returns, and what dust weakens."""
MOMENTS_A_SECOND = 1000


def returns_behind(
    before: BeforeLidar, returns: BeamReturns, firings: Firings, time_s: float
) -> BeamReturns:
    """What is returned of a turn when something is before the lidar.

    Args:
        before: A covered sector, dust, leaves, or a dirty window.
        returns: Without it.
        firings: Of all beams.
        time_s: Of the turn; dust and what a dirty window loses change with it, leaves hang still.
    """
    if isinstance(before, SectorOcclusion):
        return returns.where(~before.covers(firings.azimuth[returns.beam]))
    moment = round(time_s * MOMENTS_A_SECOND) % 2**31
    if isinstance(before, ThinnedReturns):
        drawn = np.random.default_rng([before.seed, moment, 23])
        return returns.where(drawn.random(len(returns.beam)) >= before.share)
    direction = firings.direction.astype(np.float32)
    nearest = np.full(len(direction), np.inf, np.float32)
    np.minimum.at(nearest, returns.beam, returns.distance.astype(np.float32))
    if isinstance(before, NearLeaves):
        met = meet_leaves(direction, nearest, before)
    else:
        met = meet_dust(direction, nearest, replace(before, seed=before.seed ^ moment))
    others = returns.where(~met.met[returns.beam])
    own = np.flatnonzero(met.met)
    distance, energy = met.distance[own].astype(np.float64), ENERGY * met.brightness[own]
    return _joined(others, BeamReturns(own, distance, energy.astype(np.float64)))


def _joined(one: BeamReturns, other: BeamReturns) -> BeamReturns:
    """The returns of both, in the order of their beams."""
    beam: NDArray[np.intp] = np.concatenate([one.beam, other.beam])
    order = np.argsort(beam, kind="stable")
    distance, energy = (
        np.concatenate(pair)[order]
        for pair in ((one.distance, other.distance), (one.energy, other.energy))
    )
    return BeamReturns(beam[order], distance, energy)
