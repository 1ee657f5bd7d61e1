"""The picture of one cloud's maps: camera, classes, planning map, layers."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from graspe_data.observation.intensity_map import LayerSettings
from graspe_data.robot import Footprint
from pipelines.intensity.mapped_clouds import MappedCloud, MapRequest
from pipelines.report.intensity_panels import INK, SMALL, show_classes, show_map, show_robot
from pipelines.report.intensity_picture import layer_names

Picture = NDArray[np.uint8]

ARROW = "#d62728"
WIDTH_IN, HEIGHT_IN, DPI = 16.0, 6.4, 100
MOST_LAYERS = 4
CAMERA = (0.01, 0.53, 0.375, 0.36)
CLASSES, PLANNING = (0.41, 0.11, 0.28, 0.77), (0.715, 0.11, 0.28, 0.77)
LAYERS, LAYERS_ALONE = (0.025, 0.06, 0.36, 0.42), (0.025, 0.06, 0.36, 0.82)
"""Left, bottom, width and height, of the figure's; the layers below the camera, or alone."""


def draw_frame(
    mapped: MappedCloud,
    picture: Picture | None,
    settings: LayerSettings,
    request: MapRequest,
    footprint: Footprint,
    heading: str,
) -> Picture:
    """Draw the maps of a cloud, 1600 x 640 pixels.

    Args:
        mapped: The cloud and its maps.
        picture: What the camera saw, uint8 (H, W, 3), RGB; None where there is none.
        settings: Of the layers.
        request: With the goal and the inflation.
        footprint: Of the robot.
        heading: A line above, printable ASCII.

    Returns:
        uint8 (640, 1600, 3), RGB.
    """
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    figure.text(0.012, 0.945, heading, size=11, weight="bold", color=INK, parse_math=False)
    if picture is not None:
        _camera(figure.add_axes(CAMERA), picture)
    _maps(figure, mapped, request, settings)
    _layers(figure, mapped, settings, alone=picture is None)
    for axes in figure.axes[picture is not None :]:
        show_robot(axes, footprint)
    buffer = BytesIO()
    figure.savefig(buffer, format="rgba", dpi=DPI)
    size = round(HEIGHT_IN * DPI), round(WIDTH_IN * DPI), 4
    return np.frombuffer(buffer.getvalue(), np.uint8).reshape(size)[..., :3].copy()


def _camera(axes: Axes, picture: Picture) -> None:
    axes.set_axis_off()
    axes.imshow(picture, interpolation="bilinear")
    title = "returns in solid (red) and pliable (yellow) cells"
    axes.set_title(title, size=SMALL, loc="left", color=INK, pad=4)


def _maps(
    figure: Figure, mapped: MappedCloud, request: MapRequest, settings: LayerSettings
) -> None:
    """Draw the classes, and the planning map with the goal's direction."""
    planning, half_m = request.planning, settings.grid.cells * settings.grid.cell_m / 2
    glass = None if planning.glass is None else mapped.planned.glass
    title = f"classes, equations (3) to (5), Gamma = {planning.classes.threshold:g}; metres"
    show_classes(figure.add_axes(CLASSES), mapped.planned.classes, glass, half_m, title)
    axes = figure.add_axes(PLANNING)
    title = f"planning map (11), {planning.inflation.form} inflation; the goal's direction"
    show_map(axes, mapped.planned.cost, half_m, title)
    along = 0.3 * half_m * np.array(request.goal) / max(float(np.hypot(*request.goal)), 1e-9)
    head = {"arrowstyle": "-|>", "color": ARROW, "lw": 1.5}
    axes.annotate("", xy=(-along[1], along[0]), xytext=(0, 0), arrowprops=head)


def _layers(figure: Figure, mapped: MappedCloud, settings: LayerSettings, *, alone: bool) -> None:
    """Draw the layers side by side, in two rows where no camera stands above them."""
    names = layer_names(settings)[:MOST_LAYERS]
    half_m = settings.grid.cells * settings.grid.cell_m / 2
    left, bottom, width, height = LAYERS_ALONE if alone else LAYERS
    down = 2 if alone else 1
    across = -(-len(names) // down)
    for place, (layer, name) in enumerate(zip(mapped.layers, names, strict=False)):
        row, column = divmod(place, across)
        corner = left + column * width / across, bottom + (down - 1 - row) * height / down
        box = (*corner, 0.86 * width / across, 0.86 * height / down)
        show_map(figure.add_axes(box), layer, half_m, name)
