"""What each blind reference looks at.

A reference has neither picture nor points. What it scores is what odometry tells of failures, or
at most the least ranges about the robot; a model is worth what it adds.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Floats32

VELOCITY_HISTORY, LASER_SCAN = "velocity_history", "laser_scan"

CONSTANT, SPEED, VELOCITY, HISTORY, SCAN = (
    "constant",
    "speed",
    "velocity",
    "velocity_history",
    "velocity_history_and_scan",
)
REFERENCES: Final = (CONSTANT, SPEED, VELOCITY, HISTORY, SCAN)
"""In the order of tables. The last needs the column ``laser_scan``; the others are always there."""
ALWAYS: Final = REFERENCES[:-1]
TITLES: Final = {
    CONSTANT: "blind: constant",
    SPEED: "blind: |v|",
    VELOCITY: "blind: (v, w)",
    HISTORY: "blind: velocity history",
    SCAN: "blind: velocity history and laser scan",
}

SECTORS = 36
"""Of the laser scan, each by its least range, as a tree asks about one number at a time."""
_FAR = 100.0
"""Metres, where a sector has no return."""


def blind_features(
    reference: str, velocity: Floats, columns: Mapping[str, NDArray[Any]]
) -> Floats32:
    """The features of a reference, float32 (N, F).

    ``constant`` has none: it knows how far ahead a step lies and no more. ``speed`` has the size of
    v, ``velocity`` has v and omega and their sizes; then the velocity history is added, and the
    laser scan.

    Args:
        reference: One of :data:`REFERENCES`.
        velocity: (N, 2), m/s and rad/s, of the trajectory that is asked about.
        columns: ``velocity_history`` (N, H, 2), and ``laser_scan`` (N, rays) for the last.
    """
    parts: list[NDArray[Any]] = []
    if reference == SPEED:
        parts = [np.abs(velocity[:, :1])]
    elif reference != CONSTANT:
        parts = [velocity, np.abs(velocity)]
    if reference in (HISTORY, SCAN):
        parts.append(columns[VELOCITY_HISTORY].reshape(len(velocity), -1))
    if reference == SCAN:
        parts.append(_sectors(columns[LASER_SCAN]))
    if not parts:
        return np.zeros((len(velocity), 0), np.float32)
    return np.concatenate(parts, axis=1).astype(np.float32)


def _sectors(scan: NDArray[Any]) -> NDArray[Any]:
    """The least range of each sector, (N, 36) or (N, rays) for fewer rays."""
    rays = scan.shape[1]
    starts = np.arange(min(SECTORS, rays)) * rays // min(SECTORS, rays)
    return np.minimum(np.minimum.reduceat(scan, starts, axis=1), _FAR)
