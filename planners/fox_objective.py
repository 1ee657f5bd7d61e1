"""The objective of the dynamic window approach: GrASPE equation (9), Fox et al. 1997."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings
from graspe_data.observation.trajectory import constant_velocity_arc
from graspe_data.robot import Limits
from planners.arc_distance import FreeWay
from planners.goal import heading_error
from planners.velocity_window import VelocityWindow

Weight = Annotated[float, Field(ge=0)]


class FoxWeights(Settings):
    """Weights of equation (9); GrASPE prints none.

    With the 2.0, 0.2, 0.2 of Fox et al. a robot that drives at a post halts before it, for the
    goal is straight ahead; with the defaults it goes around.
    """

    heading: Weight = 1.0
    """Of the direction to the goal, gamma_1."""
    distance: Weight = 0.3
    """Of the way until contact, gamma_2."""
    velocity: Weight = 0.3
    """Of the velocity toward the goal, gamma_3."""
    longest_distance: Annotated[float, Field(gt=0)] = 3.0
    """Metres that count as free; a nearer goal counts as the end of the way."""
    smoothing: Annotated[float, Field(ge=0, le=10)] = 1.0
    """Sigma of the smoothing over the lattice, in its steps; 0 for none."""


def fox_objective(
    window: VelocityWindow,
    way: FreeWay,
    goal: Floats,
    limits: Limits,
    interval_s: float,
    weights: FoxWeights,
) -> Floats:
    """Equation (9): Q = sigma(g1 heading + g2 dist + g3 vel), each term in 0..1.

    heading is 1 - |angle to the goal| / pi at the pose reached by driving for one interval and then
    braking as hard as possible; dist the way until contact, at most ``longest_distance`` and no
    farther than the goal; vel the share of the fastest velocity with which that pose nears the
    goal. (Fox et al. count free way beyond the goal and speed in any direction: then a robot beside
    its goal drives on, or around it for good.) A rotation on the spot covers no ground, so its dist
    is 0.

    Args:
        window: The candidates.
        way: Their free way, (K,).
        goal: (2,), base_link, metres.
        limits: Of the robot.
        interval_s: For which a velocity is held before braking.
        weights: And the smoothing.

    Returns:
        float64 (K,), the larger the better.
    """
    velocities = window.velocities
    # heading: 1 where the stopped robot faces the goal, 0 where it turns its back.
    error = heading_error(_stopped_poses(velocities, limits, interval_s), goal)
    heading = 1.0 - np.abs(error) / np.pi
    # dist: the free way, of which what lies beyond the goal does not count.
    free = np.where(velocities[:, 0] == 0, 0.0, way.length)
    farthest = min(weights.longest_distance, float(np.hypot(*goal)))
    distance = np.minimum(free, farthest) / weights.longest_distance
    # vel: the part of the speed that leads to the goal.
    fastest = max(abs(limits.linear_velocity[0]), abs(limits.linear_velocity[1]))
    nears = np.maximum(velocities[:, 0] * np.cos(error), 0.0)
    velocity = nears / fastest if fastest else np.zeros_like(heading)
    # sigma of the weighted sum: smoothed over neighbours on the lattice.
    weighted = weights.heading * heading + weights.distance * distance + weights.velocity * velocity
    return _smoothed(window, weighted, weights.smoothing)


def _stopped_poses(velocities: Floats, limits: Limits, interval_s: float) -> Floats:
    """Poses (K, 3) after the interval and maximal deceleration.

    Both parts are arcs: while it brakes, the robot covers v^2 / 2a and turns by w^2 / 2 alpha.
    """
    v, omega = velocities.T
    driven = constant_velocity_arc(v, omega, 1, interval_s)[:, 1]
    metres = v * np.abs(v) / (2 * limits.linear_acceleration)
    turned = omega * np.abs(omega) / (2 * limits.yaw_acceleration)
    braked = constant_velocity_arc(metres, turned, 1, 1.0)[:, 1]
    # The second arc begins where the first one ends.
    cosine, sine = np.cos(driven[:, 2]), np.sin(driven[:, 2])
    x = driven[:, 0] + cosine * braked[:, 0] - sine * braked[:, 1]
    y = driven[:, 1] + sine * braked[:, 0] + cosine * braked[:, 1]
    return np.stack((x, y, driven[:, 2] + braked[:, 2]), axis=1)


def _smoothed(window: VelocityWindow, values: Floats, sigma: float) -> Floats:
    """The mean over lattice neighbours, weighted by a Gaussian; what is not allowed has no say.

    Neighbours that soon touch something have a low dist, which keeps the choice off obstacles.
    """
    if sigma == 0:
        return values
    # Sums over neighbours that are allowed, divided by the sum of their weights.
    present = window.allowed.astype(np.float64)
    rows, columns = (_kernel(size, sigma) for size in window.allowed.shape)
    total = rows @ window.on_lattice(values, fill=0.0) @ columns
    share = rows @ present @ columns
    return np.asarray((total / np.where(present > 0, share, 1.0))[window.allowed])


def _kernel(size: int, sigma: float) -> Floats:
    apart = np.subtract.outer(np.arange(size), np.arange(size)) / sigma
    return np.asarray(np.exp(-0.5 * apart**2))
