"""From the layers of a cloud to the cost map for a planner: equations (3) to (11) of the paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspe_data.arrays import Map
from graspe_data.manifest import Settings
from graspe_data.observation.intensity_map.classes import (
    CellClasses,
    ClassSettings,
    classify_cells,
)
from graspe_data.observation.intensity_map.glass import GlassSettings, glass_layer
from graspe_data.observation.intensity_map.glass_memory import GlassMemory, Pose, remember_glass
from graspe_data.observation.intensity_map.inflation import (
    InflationSettings,
    inflate,
    inflation_kernel,
)
from graspe_data.observation.intensity_map.panes import extend_glass


class PlanningMapSettings(Settings):
    """How layers become a planning map."""

    classes: ClassSettings = ClassSettings()
    glass: GlassSettings | None = GlassSettings()
    """None looks for no glass."""
    inflation: InflationSettings = InflationSettings()


@dataclass(frozen=True)
class Moment:
    """When and where a cloud was taken.

    ``pose``: x, y in metres and yaw in rad, odometry frame. ``goal``: x, y in metres, base_link.
    ``eye``: of the lidar, x, y in metres, base_link.
    """

    stamp_ns: int
    pose: Pose
    goal: tuple[float, float]
    eye: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class PlanningMap:
    """Maps float32 (cells, cells), 0..1; row 0 ahead of the robot, column 0 to its left.

    ``classes``: solid and pliable cells. ``glass``: I_FN, false negatives, those remembered too.
    ``inflated``: I_infl, solid cells and glass made larger. ``cost``: I_all, what a planner reads.
    ``memory``: for the next cloud; None where no glass is looked for.
    """

    classes: CellClasses
    glass: Map
    inflated: Map
    cost: Map
    memory: GlassMemory | None


def planning_map(
    layers: Map,
    moment: Moment,
    memory: GlassMemory | None,
    cell_m: float,
    settings: PlanningMapSettings,
) -> PlanningMap:
    """Classify, look for glass, inflate, and add up.

    Equation (10): I_infl = (I_TP + I_FN) inflated. Equation (11): I_all = I_infl + I_FP. Sums count
    no higher than 1.

    Args:
        layers: float32 (layers, cells, cells), 0..1; see ``intensity_layers``.
        moment: Of the cloud.
        memory: Of the map before; None to begin.
        cell_m: Side of a cell, metres.
        settings: See ``PlanningMapSettings``.

    Raises:
        ObservationError: The goal is where the robot is, or there is no layer to find glass in.
    """
    classes, one = classify_cells(layers, settings.classes), np.float32(1)
    glass, after = _glass(layers, classes, moment, memory, cell_m, settings.glass)
    kernel = inflation_kernel(moment.goal, settings.inflation)
    inflated = inflate(np.minimum(classes.true_positive + glass, one), kernel)
    cost = np.minimum(inflated + classes.false_positive, one)
    return PlanningMap(classes, glass, inflated, cost, after)


def _glass(
    layers: Map,
    classes: CellClasses,
    moment: Moment,
    memory: GlassMemory | None,
    cell_m: float,
    settings: GlassSettings | None,
) -> tuple[Map, GlassMemory | None]:
    if settings is None:
        return np.zeros(layers.shape[1:], np.float32), None
    row, column = (layers.shape[1] / 2 - 0.5 - metres / cell_m for metres in moment.eye)
    fresh = glass_layer(layers, settings)
    fresh = extend_glass(fresh, layers, classes, (row, column), settings)
    return remember_glass(memory, fresh, moment.pose, moment.stamp_ns, cell_m, settings)
