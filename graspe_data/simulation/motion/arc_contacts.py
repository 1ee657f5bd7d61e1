"""When a robot that keeps its velocity would fail."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.robot import Footprint
from graspe_data.simulation.motion.arc_samples import (
    SAMPLE_S,
    Encounters,
    at_sample,
    first_below,
)
from graspe_data.simulation.motion.mechanics import ENTANGLES, STOPS, MechanicsSettings
from graspe_data.simulation.world.obstacles import Obstacles


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
    acting = obstacles.having("stops", "entangles", "stumbles")
    met = Encounters.along(acting, footprint, poses, velocities, horizon_s)
    first = np.full(len(poses), np.inf)
    np.minimum.at(first, met.arc, first_below(_margins(met, settings)))
    times = at_sample(_clocks(met.load(len(poses))), first)
    times[times > horizon_s] = np.inf
    return times


def _margins(met: Encounters, settings: MechanicsSettings) -> Floats:
    """Metres left until failure (K, S), negative after it."""
    gaps, kind = met.gaps, met.effect[:, None]
    began = gaps[:, :1]
    allowed = -np.log(settings.entangled_share) * met.strength[:, None]
    deeper = np.where(gaps < began - 1e-6, gaps + allowed, np.inf)
    deeper[:, 0] = np.inf
    fresh = np.where(began >= 0, gaps, np.inf)
    return np.select([kind == STOPS, kind == ENTANGLES], [gaps, deeper], fresh)


def _clocks(load: Floats) -> Floats:
    """When each sample of each arc is reached (P, S), slowed by what entangles."""
    slower = np.exp(np.clip(load - load[:, :1], 0.0, 20.0))
    elapsed = np.cumsum((slower[:, 1:] + slower[:, :-1]) / 2 * SAMPLE_S, axis=1)
    return np.concatenate([np.zeros((len(load), 1)), elapsed], axis=1)
