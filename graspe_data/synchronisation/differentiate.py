"""Velocities from poses, where a recording holds no twist."""

from __future__ import annotations

from typing import Final

import numpy as np

from graspe_data.arrays import Floats, Mask, Stamps
from graspe_data.synchronisation.rotation_steps import twist_between

SPAN_S: Final = 0.1
"""Velocities are means over so long, or over two steps where these are longer."""
HELD_S: Final = 0.25
"""A pose that is repeated no longer than this was held until the next one came."""


def fresh(stamps_ns: Stamps, positions: Floats, rotations: Floats) -> Mask:
    """Which poses (N,) are no repetition of the one before, as publishers give that hold a pose.

    A pose that stays longer than ``HELD_S`` is one of a body that stands, and all of it counts.

    Args:
        stamps_ns: (N,), ascending.
        positions: (N, 3).
        rotations: (N, 3, 3).
    """
    same = np.zeros(stamps_ns.size, np.bool_)
    same[1:] = (positions[1:] == positions[:-1]).all(axis=1)
    same[1:] &= (rotations[1:] == rotations[:-1]).all(axis=(1, 2))
    if not same.any():
        return ~same
    starts = np.flatnonzero(~same)
    ends = np.append(starts[1:], stamps_ns.size - 1)
    held = stamps_ns[ends] - stamps_ns[starts] <= round(HELD_S * 1e9)
    return np.asarray(~same | ~np.repeat(held, np.diff(np.append(starts, stamps_ns.size))))


def body_velocities(
    stamps_ns: Stamps, positions: Floats, rotations: Floats
) -> tuple[Floats, Floats]:
    """Differentiate poses: the twist between poses around each, second order for uneven stamps.

    Of poses with one stamp, the first counts and gives the velocity of all. A pose that is not
    finite is left out, and its velocity is NaN; so are all where fewer than two stamps are usable.
    A pose that is held until the next one comes gives no velocity of its own. The order of the
    poses does not matter.

    Args:
        stamps_ns: (N,) ns.
        positions: (N, 3) metres in a fixed frame.
        rotations: (N, 3, 3) of the body in the fixed frame.

    Returns:
        Velocity along body x in m/s and the rate about body z in rad/s, each float64 (N,).
    """
    linear, yaw_rate = np.full(stamps_ns.size, np.nan), np.full(stamps_ns.size, np.nan)
    # One pose a stamp, of those that have numbers.
    usable = np.isfinite(positions).all(axis=1) & np.isfinite(rotations).all(axis=(1, 2))
    unique, first, inverse = np.unique(stamps_ns[usable], return_index=True, return_inverse=True)
    position, rotation = positions[usable][first], rotations[usable][first]
    # A pose that is only repeated tells no motion: rates are those between poses that are new.
    own = fresh(unique, position, rotation)
    if np.count_nonzero(own) == 1:
        own[-1] = True
    if np.count_nonzero(own) > 1:
        seconds = (unique - unique[0]) * 1e-9
        middle, rates = _rates(seconds[own], position[own], rotation[own])
        # Each pose has the rate at its own time.
        linear[usable] = np.interp(seconds, middle, rates[:, 0])[inverse]
        yaw_rate[usable] = np.interp(seconds, middle, rates[:, 1])[inverse]
    return linear, yaw_rate


def _rates(seconds: Floats, position: Floats, rotation: Floats) -> tuple[Floats, Floats]:
    """Velocities (N, 2) over spans around each of N poses, and the middles of these spans (N,)."""
    last = seconds.size - 1
    reach = max(1, round(0.5 * SPAN_S / float(np.median(np.diff(seconds)))))
    left = np.clip(np.arange(seconds.size) - reach, 0, max(0, last - 2 * reach))
    right = np.minimum(left + 2 * reach, last)
    moved, turned = twist_between(
        (position[left], rotation[left]), (position[right], rotation[right])
    )
    span = seconds[right] - seconds[left]
    rates = np.stack([moved[:, 0], turned[:, 2]], axis=1) / span[:, None]
    return 0.5 * (seconds[right] + seconds[left]), rates
