"""Obstacles made larger by a kernel: equations (8) to (10) of the paper."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from graspe_data.arrays import Map
from graspe_data.errors import ObservationError
from graspe_data.manifest import Settings

Kernel = NDArray[np.bool_]


class InflationSettings(Settings):
    """The kernel, lengths in cells."""

    form: Literal["adaptive", "uniform"] = "adaptive"
    """A tail opposite to the goal and a small disc, or the whole square."""
    cells: Annotated[int, Field(ge=1, le=101)] = 11
    """Along each side of the kernel; odd."""
    half_width: Annotated[float, Field(ge=0)] = 2.0
    """Delta of equation (9): half the tail's width."""
    disc: Annotated[float, Field(ge=0)] = 2.0
    """Radius of the minor inflation, to all sides."""

    @model_validator(mode="after")
    def _odd(self) -> Self:
        if self.cells % 2 == 0:
            raise ValueError(f"cells {self.cells} is even: a kernel has a cell in its middle")
        return self


def goal_line(goal: tuple[float, float], settings: InflationSettings) -> Kernel:
    """The thick line through the kernel's middle along the goal's direction.

    Equation (8), r - s0 = m' (c - s0), as the distance D(r, c) = |(r - s0) d_c - (c - s0) d_r| from
    it, which has no singular direction; (d_r, d_c) = -(x, y) / |(x, y)| points to the goal.
    Equation (9): K = 1 where D <= delta.

    Args:
        goal: x, y in base_link, metres.
        settings: The kernel's size and delta.

    Returns:
        bool (k, k), the same when turned by half a turn.

    Raises:
        ObservationError: The goal is where the robot is.
    """
    down, right, (towards_row, towards_column) = *_offsets(settings.cells), _direction(goal)
    line: Kernel = np.abs(down * towards_column - right * towards_row) <= settings.half_width
    return line


def inflation_kernel(goal: tuple[float, float], settings: InflationSettings) -> Kernel:
    """The kernel of a goal: the line's half that leads away from it, and a small disc.

    Section IV-C wants the inflation opposite to the goal, which the line of (9) alone does not
    give: of it stays where 0 <= -((r - s0) d_r + (c - s0) d_c) <= s0. Uniform inflation is the
    whole square, whatever the goal.

    Args:
        goal: x, y in base_link, metres.
        settings: See ``InflationSettings``.

    Returns:
        bool (k, k), True in the middle: what it is stamped with around an obstacle; rows as the
        map's, row 0 ahead.

    Raises:
        ObservationError: The goal is where the robot is, and the form is adaptive.
    """
    if settings.form == "uniform":
        return np.ones((settings.cells, settings.cells), np.bool_)
    down, right = _offsets(settings.cells)
    towards_row, towards_column = _direction(goal)
    away = -(down * towards_row + right * towards_column)
    tail = goal_line(goal, settings) & (away >= 0) & (away <= settings.cells // 2)
    disc: Kernel = np.square(down) + np.square(right) <= settings.disc**2
    return tail | disc


def inflate(obstacles: Map, kernel: Kernel) -> Map:
    """Stamp the kernel on every obstacle.

    Equation (10) as a grey dilation, out(x) = max over u in K of I(x - u): a sum would grow with an
    obstacle's size. No cell gets lower where the kernel's middle is True.

    Args:
        obstacles: float32 (n, n), 0..1.
        kernel: bool (k, k), k odd; see ``inflation_kernel``.
    """
    # cv2.dilate takes the maximum over x + u: it stamps the kernel turned by half a turn.
    turned = kernel[::-1, ::-1].astype(np.uint8)
    grown = cv2.dilate(obstacles, turned, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    return np.asarray(grown, np.float32)


def _offsets(cells: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rows (k, 1) and columns (1, k) from the middle."""
    along = np.arange(cells, dtype=np.float64) - cells // 2
    return along[:, None], along[None, :]


def _direction(goal: tuple[float, float]) -> tuple[float, float]:
    """Towards the goal, in rows and columns; of length 1."""
    distance = math.hypot(*goal)
    if not (math.isfinite(distance) and distance > 0):
        raise ObservationError(
            f"The goal {goal} has no direction from the robot: give a finite goal other than "
            f"(0, 0) in base_link, or inflate uniformly."
        )
    return -goal[0] / distance, -goal[1] / distance
