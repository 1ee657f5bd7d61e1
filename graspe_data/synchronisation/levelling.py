"""Odometry told in a frame that is not level, as a camera's optical frame is: which way is up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.motion_samples import MotionSamples

UPWARDS: Final = np.array([0.0, 0.0, 1.0])
_STEEPEST: Final = float(np.cos(np.pi / 4))
_OPPOSITE: Final = 1e-9


def vertical_of(stretches: Sequence[MotionSamples], base: Transform | None) -> Floats:
    """The mean direction (3,) of the base's z axis in the odometry frame.

    That frame's own z axis where the two are less than 45 degrees apart, as on any slope.

    Args:
        stretches: The motion of the odometry's child frame.
        base: Where the base frame is on that body; None where it is the child frame.
    """
    axis = UPWARDS if base is None else base.rotation[:, 2]
    known = [s.rotation[np.isfinite(s.rotation).all(axis=(1, 2))] @ axis for s in stretches]
    directions = np.concatenate(known)
    mean = directions.mean(axis=0) if len(directions) else UPWARDS
    length = float(np.linalg.norm(mean))
    if length < 0.5 or mean[2] >= _STEEPEST * length:  # noqa: PLR2004 - no axis that lasts
        return UPWARDS
    upright: Floats = mean / length
    return upright


def level_finding(up: Floats, topic: str) -> list[Finding]:
    """What is done about a frame that is not level; nothing where it is."""
    if up is UPWARDS:
        return []
    tilt = float(np.degrees(np.arccos(np.clip(up[2], -1, 1))))
    text = (
        f"{topic}: the robot stands {tilt:.0f} degrees askew in its odometry frame, as in that of "
        f"a camera: poses are turned so that z points up"
    )
    return [Finding("odometry_frame_not_level", "mended", topic, text, {"tilt_deg": tilt})]


def levelled(samples: MotionSamples, up: Floats) -> MotionSamples:
    """The poses in a frame whose z axis is ``up`` (3,); the twist stays as it is."""
    if up is UPWARDS:
        return samples
    turn = _turn_upright(up)
    return replace(samples, position=samples.position @ turn.T, rotation=turn @ samples.rotation)


def _turn_upright(up: Floats) -> Floats:
    """The smallest rotation (3, 3) that carries a direction to z."""
    x, y, z = up.tolist()
    if z < _OPPOSITE - 1:
        return np.diag([1.0, -1.0, -1.0])
    skew = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    turn: Floats = np.eye(3) + skew + skew @ skew / (1 + z)
    return turn
