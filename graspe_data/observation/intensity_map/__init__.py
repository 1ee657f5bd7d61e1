"""Multi-layer intensity maps: solid, pliable, transparent and free cells by strength of returns.

Equation numbers are those of the paper "multi-layer intensity map".
"""

from graspe_data.observation.intensity_map.classes import (
    CellClasses,
    ClassSettings,
    classify_cells,
)
from graspe_data.observation.intensity_map.glass import GlassSettings, glass_layer
from graspe_data.observation.intensity_map.glass_memory import GlassMemory, remember_glass
from graspe_data.observation.intensity_map.grid import GridSettings, restore_layers, store_layers
from graspe_data.observation.intensity_map.inflation import (
    InflationSettings,
    inflate,
    inflation_kernel,
)
from graspe_data.observation.intensity_map.layers import (
    LayerSettings,
    ReturnSettings,
    intensity_layers,
)
from graspe_data.observation.intensity_map.panes import extend_glass
from graspe_data.observation.intensity_map.planning_map import (
    Moment,
    PlanningMap,
    PlanningMapSettings,
    planning_map,
)
from graspe_data.observation.intensity_map.strength import IntensityScale

__all__ = [
    "CellClasses",
    "ClassSettings",
    "GlassMemory",
    "GlassSettings",
    "GridSettings",
    "InflationSettings",
    "IntensityScale",
    "LayerSettings",
    "Moment",
    "PlanningMap",
    "PlanningMapSettings",
    "ReturnSettings",
    "classify_cells",
    "extend_glass",
    "glass_layer",
    "inflate",
    "inflation_kernel",
    "intensity_layers",
    "planning_map",
    "remember_glass",
    "restore_layers",
    "store_layers",
]
