"""Gait: how a walking body bobs and sways, and how its footfalls feel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Floats
from graspe_data.manifest import Settings

# The mean of max(cos, 0)^4 over a period.
MEAN_BUMP = 3 / 16


class GaitSettings(Settings):
    """A trot."""

    rate: Annotated[float, Field(gt=0, le=10)] = 2.0
    """Strides in a second; two footfalls each."""
    bob: Annotated[float, Field(ge=0, le=0.05)] = 0.0015
    """Metres, amplitude up and down, once a footfall."""
    sway: Annotated[float, Field(ge=0, le=0.1)] = 0.010
    """rad, amplitude of roll once a stride, and half as much of pitch once a footfall."""
    footfall: Annotated[float, Field(ge=0, le=10)] = 1.2
    """m/s^2, peak of the bump that a foot gives; upward, and a third of it backward. On the
    average over a stride there is none."""
    full_speed: Annotated[float, Field(gt=0, le=10)] = 0.25
    """m/s, or rad/s halved, at which the gait is fully there; it fades in below."""


@dataclass(frozen=True)
class Gait:
    """What walking adds at N steps.

    ``height`` metres (N,); ``tilt`` roll and pitch in rad (N, 2); ``bumps`` m/s^2 (N, 3) in
    base_link.
    """

    height: Floats
    tilt: Floats
    bumps: Floats


def walk(settings: GaitSettings, command: Floats, time_s: Floats) -> Gait:
    """The gait of a robot that is pace to move; blocked, it tramples on the spot.

    Args:
        settings: Rate and sizes.
        command: (N, 2) m/s, rad/s.
        time_s: (N,), at even steps.
    """
    pace = np.minimum(1.0, np.abs(command) @ np.array([1.0, 0.5]) / settings.full_speed)
    effort = _fade(pace, time_s)
    phase = 2 * np.pi * settings.rate * time_s
    roll = settings.sway * np.sin(phase)
    pitch = settings.sway / 2 * np.sin(2 * phase)
    height = settings.bob * np.cos(2 * phase)
    bump = settings.footfall * (np.maximum(np.cos(2 * phase), 0.0) ** 4 - MEAN_BUMP)
    bumps = np.stack([-bump / 3, np.zeros_like(bump), bump], axis=1)
    tilt = np.stack([roll, pitch], axis=1)
    return Gait(effort * height, effort[:, None] * tilt, effort[:, None] * bumps)


def _fade(pace: Floats, time_s: Floats) -> Floats:
    """A smooth start and end, over half a second."""
    step = (time_s[-1] - time_s[0]) / max(len(time_s) - 1, 1)
    window = np.hanning(max(3, round(0.5 / step) | 1) + 2)[1:-1] if step > 0 else np.ones(1)
    half = len(window) // 2
    wide = np.pad(pace, half, mode="edge")
    return np.convolve(wide, window / window.sum(), mode="valid")
