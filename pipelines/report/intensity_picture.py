"""The picture of one row's intensity map: its classes and its layers."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from graspe_data.observation.intensity_map import (
    ClassSettings,
    LayerSettings,
    classify_cells,
    restore_layers,
)
from graspe_data.robot import Footprint
from pipelines.report.intensity_panels import show_classes, show_map, show_robot

WIDTH_IN, HEIGHT_IN = 13.6, 3.4
MOST_LAYERS = 4


def draw_intensity_map(
    layers_of_row: NDArray[np.uint8], settings: LayerSettings, footprint: Footprint, dpi: int = 100
) -> bytes:
    """Draw the column ``intensity_map`` of a row as a PNG of 13.6 x 3.4 inches.

    Args:
        layers_of_row: uint8 (layers, n, n), as a row has it.
        settings: What the column was made with.
        footprint: Of the robot.
        dpi: Pixels an inch.
    """
    layers = restore_layers(layers_of_row)
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=dpi, facecolor="white")
    FigureCanvasAgg(figure)
    classes = ClassSettings()
    half_m = settings.grid.cells * settings.grid.cell_m / 2
    names = layer_names(settings)[:MOST_LAYERS]
    panels = figure.subplots(1, 1 + MOST_LAYERS)
    title = f"intensity map, Gamma = {classes.threshold:g}"
    show_classes(panels[0], classify_cells(layers, classes), None, half_m, title)
    for axes, layer, name in zip(panels[1:], layers, names, strict=False):
        show_map(axes, layer, half_m, name)
    for axes in panels[: 1 + len(names)]:
        show_robot(axes, footprint)
    for axes in panels[1 + len(names) :]:
        axes.set_axis_off()
    figure.subplots_adjust(left=0.03, right=0.99, top=0.9, bottom=0.14, wspace=0.15)
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def layer_names(settings: LayerSettings) -> list[str]:
    """What to call each layer."""
    base = "lidar" if settings.heights == "lidar" else "ground"
    return [f"{low:g} to {high:g} m from the {base}" for low, high in settings.intervals]
