"""The velocities that a robot can choose from: V_s and V_d, and what the camera sees."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from graspe_data.arrays import Floats, Mask
from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.robot import Intrinsics, Limits

_TOLERANCE = 1e-9


class VelocityWindowSettings(Settings):
    """The lattice of velocities and the time in which they have to be reached."""

    interval_s: Annotated[float, Field(gt=0, le=10)] = 0.5
    """V_d holds what maximal acceleration reaches in this time; the groups' Spot uses 0.5 s."""
    linear_step: Annotated[float, Field(ge=0.01, le=10)] = 0.1
    """m/s between neighbours of the lattice."""
    yaw_step: Annotated[float, Field(ge=0.01, le=10)] = 0.1
    """rad/s between neighbours of the lattice."""


@dataclass(frozen=True)
class VelocityWindow:
    """A lattice of velocities and those of it that may be chosen.

    ``linear``: float64 (A,), m/s. ``yaw_rate``: float64 (B,), rad/s. ``allowed``: bool (A, B).
    """

    linear: Floats
    yaw_rate: Floats
    allowed: Mask

    @property
    def velocities(self) -> Floats:
        """The allowed ones, float64 (K, 2), by linear velocity and then by yaw rate."""
        row, column = np.nonzero(self.allowed)
        return np.stack((self.linear[row], self.yaw_rate[column]), axis=1)

    def keep(self, mask: Mask) -> VelocityWindow:
        """The window with only those of its ``velocities`` that bool (K,) marks."""
        allowed = self.allowed.copy()
        allowed[self.allowed] = mask
        return replace(self, allowed=allowed)

    def on_lattice(self, values: Floats, fill: float = np.nan) -> Floats:
        """Values (K,) of the ``velocities`` laid on the lattice (A, B)."""
        laid = np.full(self.allowed.shape, fill)
        laid[self.allowed] = values
        return laid


def velocity_window(
    limits: Limits, velocity: tuple[float, float], settings: VelocityWindowSettings
) -> VelocityWindow:
    """V_s and V_d: within the limits, and within reach of the velocity driven now.

    The lattice has the multiples of its steps and the window's own ends, which can always be
    driven. Standing still and rotations on the spot are not in it: they lead nowhere, a planner
    that weighs them against others can stay where it is for good, and turning or stopping is what
    it does when it has no candidate left. A velocity outside the limits is first brought back.

    Args:
        limits: Of velocities and accelerations.
        velocity: Now, m/s and rad/s.
        settings: The lattice and the interval.
    """
    # V_s: the limits; V_d: what the accelerations reach in one interval.
    reach = (limits.linear_acceleration, limits.yaw_acceleration)
    steps = (settings.linear_step, settings.yaw_step)
    bounds = (limits.linear_velocity, limits.yaw_rate)
    linear, yaw_rate = (
        _axis(_within(bound, now, most * settings.interval_s), step)
        for bound, now, most, step in zip(bounds, velocity, reach, steps, strict=True)
    )
    moving = np.broadcast_to((linear != 0)[:, None], (len(linear), len(yaw_rate)))
    return VelocityWindow(linear, yaw_rate, moving)


def _within(bounds: tuple[float, float], now: float, reach: float) -> tuple[float, float]:
    low, high = bounds
    centre = min(max(now, low), high)
    return max(low, centre - reach), min(high, centre + reach)


def _axis(ends: tuple[float, float], step: float) -> Floats:
    """Multiples of a step between two ends, and the ends; none nearer to an end than half a step.

    Zero is kept in any case: straight lines have no neighbour to stand for them.
    """
    low, high = ends
    multiples = np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step
    inner = (multiples - low > step / 2) & (high - multiples > step / 2)
    inner_values = multiples[inner | (np.abs(multiples) < _TOLERANCE)]
    axis = np.unique(np.concatenate(([low, high], inner_values)))
    axis[np.abs(axis) < _TOLERANCE] = 0.0
    return np.unique(axis)


def view_bearings(intrinsics: Intrinsics, base_from_camera: Transform) -> tuple[float, float]:
    """Bearings of the picture's right and left edge at mid-height, rad, base_link.

    Args:
        intrinsics: Of the picture, without distortion.
        base_from_camera: Carries points of the optical frame into base_link.
    """
    middle = (intrinsics.height / 2 - intrinsics.cy) / intrinsics.fy
    # Rays through the middle of the outermost pixels, in the optical frame, turned into base_link.
    edges = (np.array([intrinsics.width - 0.5, -0.5]) - intrinsics.cx) / intrinsics.fx
    rays = np.stack((edges, np.full(2, middle), np.ones(2)), axis=1) @ base_from_camera.rotation.T
    right, left = np.arctan2(rays[:, 1], rays[:, 0]).tolist()
    return float(right), float(left)


def stays_in_view(
    velocities: NDArray[np.float64], horizon_s: float, bearings: tuple[float, float]
) -> NDArray[np.bool_]:
    """Tell which roll-outs end within the camera's field of view, or turn on the spot.

    Pure rotations are kept. The chord of an arc of constant velocity has the bearing
    omega t / 2, whatever its length, so an arc leaves the view where that passes an edge. What
    drives backwards is behind the camera.

    Args:
        velocities: float64 (K, 2), m/s and rad/s.
        horizon_s: Length of the roll-out.
        bearings: See ``view_bearings``.

    Returns:
        bool (K,).
    """
    chord = velocities[:, 1] * horizon_s / 2
    in_view = (velocities[:, 0] > 0) & (chord >= bearings[0]) & (chord <= bearings[1])
    mask: NDArray[np.bool_] = in_view | (velocities[:, 0] == 0)
    return mask
