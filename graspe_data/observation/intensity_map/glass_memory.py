"""Glass seen so far: equation (7) of the paper, with forgetting."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from graspe_data.arrays import Map
from graspe_data.observation.intensity_map.glass import GlassSettings
from graspe_data.observation.intensity_map.motion import PlanarMotion, carry_map, shift_map

Pose = tuple[float, float, float]

_NS_PER_S = 1e9


@dataclass(frozen=True)
class GlassMemory:
    """Glass in the axes of the odometry frame.

    ``glass``: float32 (m, m), 0..1, large enough for the robot's map however it is turned; row 0
    towards +x, column 0 towards +y. ``centre``: of the map, in whole cells along x and y from the
    odometry frame's origin. ``stamp_ns``: of the latest cloud.
    """

    glass: Map
    centre: tuple[int, int]
    stamp_ns: int


def remember_glass(
    memory: GlassMemory | None,
    fresh: Map,
    pose: Pose,
    stamp_ns: int,
    cell_m: float,
    settings: GlassSettings,
) -> tuple[Map, GlassMemory]:
    """Add what was seen before to what a cloud shows.

    Equation (7): I_FN = min(1, fresh + T I_FN of before), with what is remembered scaled by
    exp(-dt / memory_s). Equation (6) is applied to a memory that keeps the odometry's axes and
    moves by whole cells: carried from one robot frame to the next, motions of less than half a cell
    would be lost and larger ones rounded, cloud after cloud.

    Args:
        memory: Of the clouds before; None to begin.
        fresh: float32 (n, n), 0..1, in the robot's frame; see ``glass_layer``.
        pose: x, y in metres and yaw in rad at the cloud's stamp, odometry frame.
        stamp_ns: Of the cloud. A stamp before the memory's begins a new memory.
        cell_m: Side of a cell, metres.
        settings: See ``GlassSettings``.

    Returns:
        All glass in the robot's frame, float32 (n, n), 0..1, and the memory for the next cloud.
    """
    # The memory's own grid moves by whole cells; the robot stands within one of them.
    side = len(fresh)
    centre = (round(pose[0] / cell_m), round(pose[1] / cell_m))
    origin = (centre[0] * cell_m, centre[1] * cell_m, 0.0)
    motion = PlanarMotion.between(origin, pose)
    # Equation (6): what is remembered, faded and carried to where the robot stands.
    old = _faded(memory, centre, stamp_ns, settings)
    if old is None:
        old = np.zeros((_memory_cells(side),) * 2, np.float32)
    # Equation (7): fresh and remembered glass together, at most 1; the memory keeps both.
    one = np.float32(1)
    seen = np.minimum(fresh + carry_map(old, motion, cell_m, side), one)
    added = carry_map(fresh, motion.inverse, cell_m, len(old))
    return seen, GlassMemory(np.minimum(old + added, one), centre, stamp_ns)


def _faded(
    memory: GlassMemory | None,
    centre: tuple[int, int],
    stamp_ns: int,
    settings: GlassSettings,
) -> Map | None:
    """The memory as it is now, about another centre; None where there is none."""
    if memory is None or stamp_ns < memory.stamp_ns:
        return None
    kept = np.float32(math.exp((memory.stamp_ns - stamp_ns) / _NS_PER_S / settings.memory_s))
    faded = memory.glass * kept
    faded[faded < np.float32(settings.faintest)] = 0
    return shift_map(faded, centre[0] - memory.centre[0], centre[1] - memory.centre[1])


def _memory_cells(side: int) -> int:
    """Enough for a square of so many cells at any angle and off by half a cell; even."""
    return 2 * math.ceil(side / math.sqrt(2) + 1)
