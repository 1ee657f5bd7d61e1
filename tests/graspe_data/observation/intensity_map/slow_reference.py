"""The equations of the paper, cell by cell and point by point, in plain loops."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.observation.intensity_map.layers import LayerSettings, ReturnSettings
from graspe_data.sensor_data import PointCloud

Map = NDArray[np.float32]


def slow_layers(
    cloud: PointCloud, base_from_lidar: Transform, returns: ReturnSettings, settings: LayerSettings
) -> Map:
    """Equations (1) and (2)."""
    grid, one = settings.grid, np.float32
    assert cloud.intensity is not None
    held: dict[tuple[int, int, int], list[float]] = {}
    half, cell = one(grid.cells * grid.cell_m / 2), one(grid.cell_m)
    on_lidar = settings.heights == "lidar"
    zero = one(base_from_lidar.translation[2] if on_lidar else -returns.base_height)
    for (px, py, pz), strength in zip(cloud.xyz, cloud.intensity, strict=True):
        near = one(returns.minimum_range**2)
        if px * px + py * py + pz * pz < near:
            continue
        x, y, z = (
            one(a) * px + one(b) * py + one(c) * pz + one(shift)
            for (a, b, c), shift in zip(
                base_from_lidar.rotation, base_from_lidar.translation, strict=True
            )
        )
        row, column = math.floor((half - x) / cell), math.floor((half - y) / cell)
        if not (0 <= row < grid.cells and 0 <= column < grid.cells):
            continue
        for layer, (low, high) in enumerate(settings.intervals):
            if one(low) <= z - zero < one(high):
                value = min(float(strength), returns.intensity_maximum)
                held.setdefault((layer, row, column), []).append(value)
    layers = np.zeros((len(settings.intervals), grid.cells, grid.cells), np.float32)
    for place, values in held.items():
        whole = {"sum": sum(values), "max": max(values), "mean": sum(values) / len(values)}
        layers[place] = min(whole[settings.cell] / returns.intensity_maximum, 1.0)
    return layers


def slow_classes(layers: Map, threshold: float, reading: str) -> tuple[Map, Map]:
    """Equations (3) to (5)."""
    solid, pliable = np.zeros_like(layers[0]), np.zeros_like(layers[0])
    for row in range(layers.shape[1]):
        for column in range(layers.shape[2]):
            total = np.float32(0)
            for value in layers[:, row, column]:
                total += value
            total = min(total, np.float32(1))
            asked = [total] if reading == "sum" else list(layers[:, row, column])
            if all(value <= np.float32(threshold) for value in asked):
                pliable[row, column] = total
            else:
                solid[row, column] = total
    return solid, pliable


def slow_carry(values: Map, motion: tuple[float, float, float], cell_m: float, size: int) -> Map:
    """Equation (6), one cell of the new map after the other."""
    forward, left, turn = motion
    side, carried = len(values), np.zeros((size, size), np.float32)
    for row in range(size):
        for column in range(size):
            ahead, aside = size / 2 - row - 0.5, size / 2 - column - 0.5
            x = math.cos(turn) * ahead + forward / cell_m - math.sin(turn) * aside
            y = math.sin(turn) * ahead + left / cell_m + math.cos(turn) * aside
            old_row, old_column = math.floor(side / 2 + 1 - x) - 1, math.floor(side / 2 + 1 - y) - 1
            if 0 <= old_row < side and 0 <= old_column < side:
                carried[row, column] = values[old_row, old_column]
    return carried


def slow_inflation(obstacles: Map, kernel: NDArray[np.bool_]) -> Map:
    """Equation (10): each obstacle stamps the kernel."""
    size, reach = len(obstacles), len(kernel) // 2
    grown = np.zeros_like(obstacles)
    for row, column in np.argwhere(obstacles > 0).tolist():
        for down, right in (np.argwhere(kernel) - reach).tolist():
            if 0 <= row + down < size and 0 <= column + right < size:
                here = row + down, column + right
                grown[here] = max(grown[here], obstacles[row, column])
    return grown


def slow_kernel(goal: tuple[float, float], cells: int, width: float, disc: float) -> Map:
    """Equations (8) and (9), the tail of the prose and the disc; 1 where the kernel is."""
    middle, kernel = (cells - 1) / 2, np.zeros((cells, cells), np.float32)
    distance = math.hypot(*goal)
    to_row, to_column = -goal[0] / distance, -goal[1] / distance
    for row in range(cells):
        for column in range(cells):
            down, right = row - middle, column - middle
            off = abs(down * to_column - right * to_row)
            away = -(down * to_row + right * to_column)
            near = down**2 + right**2 <= disc**2
            kernel[row, column] = near or (off <= width and 0 <= away <= middle)
    return kernel
