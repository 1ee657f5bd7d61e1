"""A spinning lidar in a world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform
from graspe_data.simulation.lidar.beams import POINT_TYPE, firings_of_turn, moving_rays, sub_rays
from graspe_data.simulation.lidar.before import returns_behind
from graspe_data.simulation.lidar.echoes import Surfaces
from graspe_data.simulation.lidar.occlusion import BeforeLidar
from graspe_data.simulation.lidar.receiver import BeamReturns, receive
from graspe_data.simulation.lidar.settings import LidarSettings
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.world import World

_KNOTS: Final = 20
_FULL_INTENSITY: Final = 255.0
_MARGIN: Final = 0.05
"""Metres by which noise may bring a return nearer than the minimum range."""


class Lidar:
    """A VLP-16 on a robot: beams of finite width, mixed returns, distorted by motion.

    All beams start at the sensor's origin; the offsets of its optics, some centimetres, are left
    out, as the driver corrects for them.
    """

    def __init__(
        self, world: World, scene: RayScene, settings: LidarSettings, *, front_only: bool = False
    ) -> None:
        """Prepare the beams; ``scene`` holds the world's surfaces.

        With ``front_only`` beams are left out that can return nothing from x >= 0 in base_link.
        """
        self._settings = settings
        self._surfaces = Surfaces(scene, world.materials)
        firings = firings_of_turn(settings.rotation_rate)
        rays = sub_rays(firings.direction, settings.divergence, settings.sub_rays)
        kept = self._reach_ahead(firings.direction) if front_only else slice(None)
        self._firings, self._rays = firings.where(kept), rays[kept]

    @property
    def base_from_lidar(self) -> Transform:
        """Carries points of the sensor into base_link."""
        return self._settings.mounting.transform

    def turn(
        self,
        time_s: float,
        base_pose: Callable[[float], Transform],
        generator: np.random.Generator,
        occlusion: BeforeLidar | None = None,
    ) -> NDArray[np.void]:
        """One turn as the driver publishes it; ``POINT_TYPE`` (N,), in firing order.

        A point lies at the measured range along the beam's axis in the sensor's frame at its own
        firing, so the cloud is distorted by the motion, as the driver's is.

        Args:
            time_s: Of the first firing, from which the points' times count.
            base_pose: base_link in the world at a time in seconds, as ``Drive.base_pose``.
            generator: Draws the noise.
            occlusion: What is on the window, or right before it.
        """
        knot, poses = self._sweep(time_s, base_pose)
        echoes = self._surfaces.echoes(*moving_rays(self._rays, knot, poses))
        returns = receive(echoes, self._settings, generator)
        if occlusion is not None:
            returns = returns_behind(occlusion, returns, self._firings, time_s)
        return self._points(returns, generator)

    def _reach_ahead(self, directions: Floats) -> NDArray[np.bool_]:
        """Whether beams (N, 3) that are longer than the minimum range can end at x >= 0."""
        mounted, nearest = self.base_from_lidar, self._settings.minimum_range - _MARGIN
        along = directions @ mounted.rotation[0]
        ahead: NDArray[np.bool_] = (along >= 0) | (mounted.translation[0] + nearest * along >= 0)
        return ahead

    def _sweep(
        self, time_s: float, base_pose: Callable[[float], Transform]
    ) -> tuple[Floats, list[Transform]]:
        """When each beam is fired, in steps of a turn's knots, and the sensor at the knots."""
        intervals = _KNOTS if self._settings.motion_distortion else 0
        step = 1.0 / (self._settings.rotation_rate * _KNOTS)
        times = time_s + step * np.arange(intervals + 1)
        poses = [base_pose(float(time)) @ self.base_from_lidar for time in times]
        return self._firings.time_s / step, poses

    def _points(self, returns: BeamReturns, generator: np.random.Generator) -> NDArray[np.void]:
        """What the driver makes of returns, with the sensor's noise."""
        settings, firings, beam = self._settings, self._firings, returns.beam
        ranges = returns.distance + generator.normal(0, settings.range_noise, len(beam))
        counts = _FULL_INTENSITY * returns.energy
        counts += generator.normal(0, settings.intensity_noise, len(beam))
        points = np.empty(len(beam), POINT_TYPE)
        for name, axis in zip("xyz", firings.direction.T, strict=True):
            points[name] = axis[beam] * ranges
        points["intensity"] = np.rint(np.clip(counts, 0, _FULL_INTENSITY))
        points["ring"], points["time"] = firings.ring[beam], firings.time_s[beam]
        return points
