"""When a robot that keeps its velocity would fail."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Floats
from graspe_data.observation.trajectory_arc import constant_velocity_arc
from graspe_data.robot import Footprint
from graspe_data.simulation.motion.footprint import capsule_clearance
from graspe_data.simulation.motion.mechanics import ENTANGLES, STOPS, MechanicsSettings
from graspe_data.simulation.world.obstacles import Obstacles

SAMPLE_S = 0.05

Indices = NDArray[np.intp]


def failure_times(
    obstacles: Obstacles,
    footprint: Footprint,
    poses: Floats,
    velocities: Floats,
    horizon_s: float,
    settings: MechanicsSettings,
) -> Floats:
    """Seconds until each arc fails, float64 (P,), inf where it does not within the horizon.

    An arc fails when the footprint meets something that stops the robot; when it comes over a rock
    that it was not over at the start; and when it is so deep in what entangles that less than
    ``settings.entangled_share`` of the speed is left, and deeper than at the start: the way out
    does not fail. Vegetation makes the robot late on its arc by exp(depth / strength).

    Args:
        obstacles: What acts on the robot.
        footprint: Its rectangle.
        poses: (P, 3) x, y, yaw at the start of each arc; world frame, metres, rad.
        velocities: (P, 2) v and omega, m/s and rad/s.
        horizon_s: Length of the arcs.
        settings: How contact acts.
    """
    count = int(np.ceil(horizon_s / SAMPLE_S - 1e-9))
    arcs = arc_poses(poses, velocities, count, SAMPLE_S)
    acting = obstacles.having("stops", "entangles", "stumbles")
    arc, obstacle = _pairs(acting, footprint, poses, np.abs(velocities[:, 0]) * horizon_s)
    ends = acting.start[obstacle, None], acting.end[obstacle, None]
    gaps = capsule_clearance(footprint, arcs[arc], *ends, acting.radius[obstacle, None])
    effect, strength = acting.effect[obstacle], acting.strength[obstacle]
    failing = _failing_sample(_margins(gaps, effect, strength, settings))
    first = np.full(len(poses), np.inf)
    np.minimum.at(first, arc, failing)
    held = effect == ENTANGLES
    late = _clocks(gaps[held], strength[held], arc[held], len(poses))
    times = _at_sample(late, first)
    times[times > horizon_s] = np.inf
    return times


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


def _margins(
    gaps: Floats, effect: NDArray[np.uint8], strength: Floats, settings: MechanicsSettings
) -> Floats:
    """Metres left until failure (K, S), negative after it."""
    began = gaps[:, :1]
    kind = effect[:, None]
    allowed = -np.log(settings.entangled_share) * strength[:, None]
    deeper = np.where(gaps < began - 1e-6, gaps + allowed, np.inf)
    deeper[:, 0] = np.inf
    fresh = np.where(began >= 0, gaps, np.inf)
    return np.select([kind == STOPS, kind == ENTANGLES], [gaps, deeper], fresh)


def _failing_sample(margins: Floats) -> Floats:
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


def _clocks(gaps: Floats, strength: Floats, arc: Indices, arcs: int) -> Floats:
    """When each sample of each arc is reached (P, S), slowed by what entangles."""
    load = np.zeros((arcs, gaps.shape[1]))
    np.maximum.at(load, arc, np.maximum(-gaps, 0.0) / np.maximum(strength, 1e-6)[:, None])
    slower = np.exp(np.clip(load - load[:, :1], 0.0, 20.0))
    elapsed = np.cumsum((slower[:, 1:] + slower[:, :-1]) / 2 * SAMPLE_S, axis=1)
    return np.concatenate([np.zeros((arcs, 1)), elapsed], axis=1)


def _at_sample(clocks: Floats, sample: Floats) -> Floats:
    """The time at a sample with a fraction (P,); inf stays."""
    known = np.where(np.isfinite(sample), sample, 0.0)
    low = np.minimum(known.astype(np.intp), clocks.shape[1] - 2)
    rows = np.arange(len(clocks))
    part = known - low
    time = clocks[rows, low] * (1 - part) + clocks[rows, low + 1] * part
    return np.where(np.isfinite(sample), time, np.inf)
