"""When a robot that keeps its command would fail."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.robot import Footprint
from graspe_data.simulation.motion.arc_samples import (
    SAMPLE_S,
    Encounters,
    at_sample,
    first_below,
)
from graspe_data.simulation.motion.mechanics import SLOWS, STOPS, STUMBLES, MechanicsSettings
from graspe_data.simulation.world.obstacles import Obstacles


def commanded_failure_times(
    obstacles: Obstacles,
    footprint: Footprint,
    poses: Floats,
    commands: Floats,
    horizon_s: float,
    settings: MechanicsSettings,
) -> Floats:
    """Seconds until each commanded arc fails, float64 (P,), inf where not within the horizon.

    The robot follows the arc at the share of its speed that vegetation leaves: what slows takes
    its part, what entangles leaves exp(-depth / strength), on the way out no less than
    ``settings.leaving_share``. An arc fails when less than ``settings.entangled_share`` is left in
    what entangles, when the footprint meets something that stops the robot, and when it comes over
    a rock that it was not over at the start. A robot that is asked to stand does not fail.

    Args:
        obstacles: What acts on the robot.
        footprint: Its rectangle.
        poses: (P, 3) x, y, yaw at the start of each arc; world frame, metres, rad.
        commands: (P, 2) v and omega, m/s and rad/s.
        horizon_s: Length of the arcs.
        settings: How contact acts.
    """
    acting = obstacles.having("stops", "entangles", "stumbles", "slows")
    met = Encounters.along(acting, footprint, poses, commands, horizon_s)
    load = met.load(len(poses))
    share = _slowed(met, load.shape) * _held(load, settings)
    moving = np.any(commands != 0, axis=1)[:, None]
    first = _first(moving & (load > 0) & (share < settings.entangled_share))
    hits = (met.effect == STOPS) | ((met.effect == STUMBLES) & (met.gaps[:, 0] >= 0))
    np.minimum.at(first, met.arc[hits], first_below(met.gaps[hits]))
    times = at_sample(_clock(share), first)
    times[times > horizon_s] = np.inf
    return times


def _slowed(met: Encounters, shape: tuple[int, ...]) -> Floats:
    """The share of the speed that the worst of what slows leaves (P, S)."""
    share, slows = np.ones(shape), met.effect == SLOWS
    left = np.where(met.gaps[slows] < 0, met.strength[slows, None], 1.0)
    np.minimum.at(share, met.arc[slows], left)
    return share


def _held(load: Floats, settings: MechanicsSettings) -> Floats:
    """The share that entanglement leaves (P, S): on the way out, what is needed to get out."""
    share = np.exp(-load)
    leaving = np.zeros(load.shape, np.bool_)
    leaving[:, :-1] = load[:, 1:] < load[:, :-1]
    return np.where(leaving, np.maximum(share, settings.leaving_share), share)


def _first(mask: NDArray[np.bool_]) -> Floats:
    """The first true sample of each row (P, S), inf where there is none."""
    return np.where(mask.any(axis=1), mask.argmax(axis=1).astype(np.float64), np.inf)


def _clock(share: Floats) -> Floats:
    """When each sample is reached (P, S), seconds; after a share of 0, never."""
    step_s = SAMPLE_S / np.maximum((share[:, 1:] + share[:, :-1]) / 2, 1e-9)
    return np.concatenate([np.zeros((len(share), 1)), np.cumsum(step_s, axis=1)], axis=1)
