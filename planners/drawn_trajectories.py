"""Trajectory images of a robot, each velocity drawn once."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from graspe_data.observation.predicted_trajectory import PredictedTrajectory

KEPT = 256
"""Images; more than a planner's lattice has."""


class DrawnTrajectories:
    """Draws trajectories, and keeps the latest: a lattice asks for the same ones every time."""

    def __init__(self, drawing: PredictedTrajectory) -> None:
        """Take what draws them."""
        self._drawing = drawing
        self._kept: OrderedDict[tuple[float, float], NDArray[np.uint8]] = OrderedDict()

    def draw(self, velocities: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Trajectory images, bool (K, H, W), of velocities (K, 2) in m/s and rad/s."""
        size = (self._drawing.intrinsics.height, self._drawing.intrinsics.width)
        images = np.empty((len(velocities), *size), np.bool_)
        for row, (v, omega) in enumerate(velocities.tolist()):
            images[row] = self._image(v, omega)
        return images

    def _image(self, v: float, omega: float) -> NDArray[np.bool_]:
        packed = self._kept.pop((v, omega), None)
        if packed is None:
            packed = np.packbits(self._drawing.draw(v, omega), axis=-1)
        self._kept[v, omega] = packed
        if len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        width = self._drawing.intrinsics.width
        return np.unpackbits(packed, axis=-1, count=width).view(np.bool_)
