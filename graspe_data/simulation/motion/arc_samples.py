"""Arcs in the world, sample by sample: where they are, and how near they come to what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.observation.trajectory import constant_velocity_arc
from graspe_data.robot import Footprint
from graspe_data.simulation.motion.footprint import capsule_clearance
from graspe_data.simulation.motion.mechanics import ENTANGLES
from graspe_data.simulation.world.obstacles import Obstacles

SAMPLE_S = 0.05
"""Seconds of driving between two samples, where nothing slows the robot."""

Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Encounters:
    """K pairs of an arc and an obstacle that it can reach.

    ``arc`` (K,): which of P arcs. ``gaps`` float64 (K, S): metres between the footprint and the
    obstacle at each sample, negative inside. ``effect`` uint8, ``strength`` float64 (K,): of the
    obstacle.
    """

    arc: Indices
    gaps: Floats
    effect: NDArray[np.uint8]
    strength: Floats

    @classmethod
    def along(
        cls,
        obstacles: Obstacles,
        footprint: Footprint,
        poses: Floats,
        velocities: Floats,
        horizon_s: float,
    ) -> Encounters:
        """Those of arcs from poses (P, 3) at velocities (P, 2), a sample each ``SAMPLE_S``."""
        count = int(np.ceil(horizon_s / SAMPLE_S - 1e-9))
        arcs = arc_poses(poses, velocities, count, SAMPLE_S)
        ways = np.abs(velocities[:, 0]) * horizon_s
        arc, obstacle = _pairs(obstacles, footprint, poses, ways)
        ends = obstacles.start[obstacle, None], obstacles.end[obstacle, None]
        gaps = capsule_clearance(footprint, arcs[arc], *ends, obstacles.radius[obstacle, None])
        return cls(arc, gaps, obstacles.effect[obstacle], obstacles.strength[obstacle])

    def load(self, arcs: int) -> Floats:
        """Depth over strength in what entangles the most, at each sample of P arcs (P, S)."""
        load, held = np.zeros((arcs, self.gaps.shape[1])), self.effect == ENTANGLES
        depth = np.maximum(-self.gaps[held], 0.0)
        np.maximum.at(load, self.arc[held], depth / np.maximum(self.strength[held], 1e-6)[:, None])
        return load


def arc_poses(poses: Floats, velocities: Floats, steps: int, step_s: float) -> Floats:
    """Poses (P, steps + 1, 3) in the world along arcs of constant velocity; yaw not wrapped."""
    arcs = constant_velocity_arc(velocities[:, 0], velocities[:, 1], steps, step_s)
    x, y, yaw = (poses[:, None, axis] for axis in range(3))
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.stack(
        [
            x + cosine * arcs[..., 0] - sine * arcs[..., 1],
            y + sine * arcs[..., 0] + cosine * arcs[..., 1],
            yaw + arcs[..., 2],
        ],
        axis=-1,
    )


def _pairs(
    obstacles: Obstacles, footprint: Footprint, poses: Floats, ways: Floats
) -> tuple[Indices, Indices]:
    """Which arcs can reach which obstacles at all: indices of arcs and of obstacles, (K,) each."""
    along = obstacles.end - obstacles.start
    square = np.maximum(np.sum(along**2, axis=1), 1e-12)
    offset = poses[:, None, :2] - obstacles.start
    share = np.clip(np.einsum("pnk,nk->pn", offset, along) / square, 0.0, 1.0)
    distance = np.linalg.norm(offset - share[..., None] * along, axis=-1)
    reach = np.hypot(footprint.length, footprint.width) / 2 + ways[:, None] + obstacles.radius
    arc, obstacle = np.nonzero(distance <= reach)
    return arc, obstacle


def first_below(margins: Floats) -> Floats:
    """The sample, with its fraction, at which each row (K, S) first falls below 0, else inf."""
    below = margins < 0
    after = np.argmax(below, axis=1)
    rows = np.arange(len(margins))
    low, high = margins[rows, after], margins[rows, np.maximum(after - 1, 0)]
    falls = np.isfinite(high) & (high > low)
    fall = np.subtract(high, low, out=np.ones_like(low), where=falls)
    part = np.divide(high, fall, out=np.ones_like(low), where=falls)
    sample = np.where(after > 0, after - 1 + part, 0.0)
    return np.where(below.any(axis=1), sample, np.inf)


def at_sample(clocks: Floats, sample: Floats) -> Floats:
    """The time at a sample with a fraction (P,); inf stays."""
    known = np.where(np.isfinite(sample), sample, 0.0)
    low = np.minimum(known.astype(np.intp), clocks.shape[1] - 2)
    rows = np.arange(len(clocks))
    part = known - low
    time = clocks[rows, low] * (1 - part) + clocks[rows, low + 1] * part
    return np.where(np.isfinite(sample), time, np.inf)
