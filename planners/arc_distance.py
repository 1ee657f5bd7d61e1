"""How far a robot that keeps its velocity gets before it meets an obstacle, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.robot import Limits
from planners.body_discs import Body

_STRAIGHT = 1e-6
"""rad/s below which an arc is a line: over 10 m it would leave it by less than 0.1 mm."""


@dataclass(frozen=True)
class FreeWay:
    """The way along each arc until the first contact; inf where there is none.

    ``seconds``: float64 (K,). ``length``: metres of base_link's path. ``turn``: rad.
    """

    seconds: Floats
    length: Floats
    turn: Floats


def free_way(velocities: Floats, points: Floats, body: Body) -> FreeWay:
    """The way of a body along arcs until a disc of it touches a point while it comes nearer to it.

    A point that is inside a disc at the start counts when the motion brings the disc's centre
    nearer: then there is no way at all. On the way out it does not count. Rotations on the spot
    touch nothing beyond the turning radius.

    Args:
        velocities: (K, 2), m/s and rad/s; negative drives backwards.
        points: Obstacles (N, 2), metres, base_link.
        body: The robot, see ``body_discs``.

    Returns:
        Rotations on the spot have a length of 0 and a turn, or inf both.
    """
    seconds = np.full(len(velocities), np.inf)
    # A rotation on the spot meets only what lies within the turning radius.
    around = points[np.hypot(points[:, 0], points[:, 1]) <= body.turning_radius]
    on_the_spot = velocities[:, 0] == 0
    for rows, near in ((on_the_spot, around), (~on_the_spot, points)):
        for offset, radius in body.discs.tolist():
            contact = _contacts(velocities[rows], near, offset, radius)
            seconds[rows] = np.minimum(seconds[rows], contact)
    # Seconds until contact to metres and radians; inf * 0 would be no number.
    free = np.isinf(seconds)
    length, turn = (np.abs(velocities) * np.where(free, 0.0, seconds)[:, None]).T
    return FreeWay(seconds, np.where(free, np.inf, length), np.where(free, np.inf, turn))


def admissible(
    velocities: Floats, way: FreeWay, limits: Limits, reaction_s: float = 0.0
) -> NDArray[np.bool_]:
    """V_a: the robot can stop before it touches anything (Fox et al. 1997).

    v <= sqrt(2 dist a) and |omega| <= sqrt(2 turn alpha), where dist and turn are the metres and
    the radians until contact; a contact that is there already admits nothing.

    Args:
        velocities: float64 (K, 2), m/s and rad/s.
        way: Of the same arcs.
        limits: Their accelerations are the decelerations.
        reaction_s: Time that passes before the robot brakes; it drives on meanwhile.
    """
    v, omega = np.abs(velocities).T
    # v <= sqrt(2 dist a), with dist what is left after the reaction.
    left = np.maximum(way.length - v * reaction_s, 0.0)
    stops = v <= np.sqrt(2 * left * limits.linear_acceleration)
    # |omega| <= sqrt(2 turn alpha), likewise.
    angle = np.maximum(way.turn - omega * reaction_s, 0.0)
    stands = omega <= np.sqrt(2 * angle * limits.yaw_acceleration)
    admitted: NDArray[np.bool_] = stops & stands & (way.seconds > 0)
    return admitted


def _contacts(velocities: Floats, points: Floats, offset: float, radius: float) -> Floats:
    """Seconds (K,) until one disc's first contact."""
    seconds = np.full(len(velocities), np.inf)
    straight = np.abs(velocities[:, 1]) < _STRAIGHT
    for row in np.flatnonzero(straight):
        seconds[row] = _contact_straight(float(velocities[row, 0]), points, offset, radius)
    v, omega = velocities[~straight].T
    seconds[~straight] = _contacts_turning(v, omega, points, offset, radius)
    return seconds


def _contacts_turning(
    v: Floats, omega: Floats, points: Floats, offset: float, radius: float
) -> Floats:
    # The disc's centre goes round the centre of rotation (0, rho) on its own circle.
    rho = v / omega
    own = np.hypot(offset, rho)
    distance = np.hypot(points[:, 0], points[:, 1] - rho[:, None])
    # Only points whose circle comes within the disc's radius are met.
    near = (np.abs(distance - own[:, None]) <= radius) & (distance > 0) & (own[:, None] > 0)
    arc, point = np.nonzero(near)
    x, y, distance = points[point, 0], points[point, 1] - rho[arc], distance[arc, point]
    # The angle from the disc's centre to the point, in the direction of the motion.
    start = np.arctan2(-rho, offset)[arc]
    ahead = np.sign(omega[arc]) * (np.arctan2(y, x) - start) % (2 * np.pi)
    # Law of cosines: at contact, the triangle of both centres and the point has the side radius.
    cosine = (own[arc] ** 2 + distance**2 - radius**2) / (2 * own[arc] * distance)
    half = np.arccos(np.clip(cosine, -1.0, 1.0))
    inside = (ahead > 0) & (ahead < half)
    angle = np.full(len(v), np.inf)
    np.minimum.at(angle, arc, np.where(inside, 0.0, (ahead - half) % (2 * np.pi)))
    return angle / np.abs(omega)


def _contact_straight(v: float, points: Floats, offset: float, radius: float) -> float:
    ahead = (points[:, 0] - offset) * np.sign(v)
    aside = np.abs(points[:, 1])
    hit = (aside <= radius) & (ahead > 0)
    if v == 0 or not hit.any():
        return float(np.inf)
    # Pythagoras: the disc touches that much before its centre is beside the point.
    reach = ahead[hit] - np.sqrt(radius**2 - aside[hit] ** 2)
    return float(max(reach.min(), 0.0) / abs(v))
