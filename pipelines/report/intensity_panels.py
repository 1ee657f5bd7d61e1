"""Intensity maps on axes: forward is up, left is left, metres."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle

from graspe_data.arrays import Map
from graspe_data.observation.intensity_map import CellClasses
from graspe_data.robot import Footprint

COLOURS = {
    "solid": (0.80, 0.11, 0.13),
    "pliable": (0.95, 0.71, 0.10),
    "glass": (0.16, 0.42, 0.86),
}
FAINTEST = 0.45
"""How much of its colour a cell of no strength has."""
INK = "#222222"
SMALL = 8


def show_map(axes: Axes, values: Map, half_m: float, title: str) -> None:
    """Draw one layer or the planning map, 0..1; empty cells are white.

    Args:
        axes: Where.
        values: float32 (n, n), row 0 ahead, column 0 left.
        half_m: Half the map's side, metres.
        title: Of the panel.
    """
    _show(axes, np.ma.masked_equal(values, 0), half_m, cmap="viridis", vmin=0, vmax=1)
    _finish(axes, half_m, title)


def show_classes(
    axes: Axes, classes: CellClasses, glass: Map | None, half_m: float, title: str
) -> None:
    """Draw solid, pliable and transparent cells, the stronger the darker, with a legend."""
    picture = np.ones((*classes.true_positive.shape, 3))
    shown = {"pliable": classes.false_positive, "solid": classes.true_positive}
    if glass is not None:
        shown["glass"] = np.where(classes.true_positive > 0, np.float32(0), glass)
    for kind, values in shown.items():
        weight = np.where(values > 0, FAINTEST + (1 - FAINTEST) * values, 0)[..., None]
        picture = picture * (1 - weight) + np.array(COLOURS[kind]) * weight
    _show(axes, picture, half_m)
    _finish(axes, half_m, title)
    patches = [Patch(color=COLOURS[kind], label=kind) for kind in shown]
    axes.legend(
        handles=[*patches, Patch(facecolor="white", edgecolor="#999999", label="free")],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.06),
        fontsize=SMALL - 0.5,
        frameon=False,
        ncols=4,
    )


def show_robot(axes: Axes, footprint: Footprint) -> None:
    """Draw the robot, centred on base_link."""
    corner = (-footprint.width / 2, -footprint.length / 2)
    size = footprint.width, footprint.length
    axes.add_patch(Rectangle(corner, *size, facecolor="#44444455", edgecolor=INK, lw=0.8))


def _show(axes: Axes, picture: Any, half_m: float, **how: Any) -> None:
    extent = (-half_m, half_m, -half_m, half_m)
    axes.imshow(picture, extent=extent, origin="upper", interpolation="nearest", **how)


def _finish(axes: Axes, half_m: float, title: str) -> None:
    ticks = np.linspace(-half_m, half_m, 5)
    axes.set_xticks(ticks, [f"{0 - tick:g}" for tick in ticks])
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.tick_params(labelsize=SMALL - 1.5, length=2, colors="#555555")
    for side in axes.spines.values():
        side.set_color("#cccccc")
    axes.set_title(title, size=SMALL, loc="left", color=INK, pad=4)
