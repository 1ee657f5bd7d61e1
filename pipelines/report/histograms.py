"""Distributions of scalar columns, over all splits on the same bins, and their drawing."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from math import ceil, floor
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.columns import Column
from graspe_data.observation.catalogue import RELIABILITIES
from pipelines.report.row_blocks import row_blocks

SPLIT_COLOURS = ("#4c8dcb", "#e08a2e", "#4aa564", "#a06cc0", "#888888")
BINS = 33
"""Odd, so that rows of one and the same value fill the bin in the middle."""
ANCHOR = "stamp_ns"
"""A time of its own, of which a distribution says nothing."""
LABEL_WIDTH = 52
INK = "#010203"
"""Stands for the page's own colour of text until the drawing is written."""


@dataclass(frozen=True)
class Quantity:
    """A column to draw: what a unit on the axis is worth, and its range where that is known.

    Where it is not, and all values lie closer than ``room`` on either side, the axis has that room.
    """

    column: str
    label: str
    unit: float = 1.0
    limits: tuple[float, float] | None = None
    room: float = 0.5


def measured_quantities(columns: Iterable[Column]) -> list[Quantity]:
    """The scalar columns of a dataset that have a unit; nanoseconds are drawn as milliseconds."""
    return [
        _quantity(column)
        for column in columns
        if column.shape == () and column.unit and column.name != ANCHOR
    ]


def _quantity(column: Column) -> Quantity:
    meaning = column.meaning.partition(";")[0]
    name, limits = column.name, (0.0, 1.0) if column.name in RELIABILITIES else None
    if column.unit == "ns":
        label = textwrap.fill(f"{name.removesuffix('_ns')}: {meaning}, ms", LABEL_WIDTH)
        return Quantity(name, label, unit=1e6, room=1)
    return Quantity(name, textwrap.fill(f"{name}: {meaning}", LABEL_WIDTH), limits=limits)


@dataclass(frozen=True)
class RowHistogram:
    """Rows in each bin, by split; ``edges`` (B + 1,) in the quantity's unit."""

    quantity: Quantity
    edges: Floats
    counts: dict[str, NDArray[np.int64]]


def histograms(
    folder: Path, splits: Collection[str], quantities: Sequence[Quantity]
) -> list[RowHistogram]:
    """Count the rows of each split in each bin.

    Raises:
        ShardError: A shard is missing or damaged, or a column is not there.
    """
    edges = _edges(folder, splits, quantities)
    counted_rows = [
        RowHistogram(
            quantity, edges[quantity.column], {s: np.zeros(BINS, np.int64) for s in splits}
        )
        for quantity in quantities
    ]
    for split in splits:
        for block in row_blocks(folder, split, [quantity.column for quantity in quantities]):
            for histogram in counted_rows:
                values = block.columns[histogram.quantity.column] / histogram.quantity.unit
                inside = np.clip(values, histogram.edges[0], histogram.edges[-1])
                histogram.counts[split][:] += np.histogram(inside, histogram.edges)[0]
    return counted_rows


def _edges(
    folder: Path, splits: Collection[str], quantities: Sequence[Quantity]
) -> dict[str, Floats]:
    limits = {quantity.column: quantity.limits for quantity in quantities}
    unknown = {quantity.column: quantity.unit for quantity in quantities if not quantity.limits}
    for split in splits:
        for block in row_blocks(folder, split, unknown):
            for column, unit in unknown.items():
                values = block.columns[column] / unit
                low, high = limits[column] or (np.inf, -np.inf)
                limits[column] = (min(low, values.min()), max(high, values.max()))
    return {q.column: _bins(*(limits[q.column] or (0.0, 1.0)), q.room) for q in quantities}


def _bins(low: float, high: float, room: float) -> Floats:
    """Bins over a range, which is widened to whole units and some room where it is narrow."""
    if high - low < 2 * room:
        room = max(room, abs(low) / 20)
        low, high = floor(low) - room, ceil(high) + room
    return np.linspace(low, high, BINS + 1)


def split_colours(splits: Sequence[str]) -> dict[str, str]:
    """A colour for each split."""
    return {
        split: SPLIT_COLOURS[number % len(SPLIT_COLOURS)] for number, split in enumerate(splits)
    }


def histogram_svg(histogram: RowHistogram, colours: Mapping[str, str]) -> Markup:
    """Draw a histogram as SVG to put into a page; its lines and text take the page's colour."""
    style: Any = {
        "svg.fonttype": "none",
        "svg.hashsalt": histogram.quantity.column,
        "text.color": INK,
        "axes.edgecolor": INK,
        "axes.labelcolor": INK,
        "xtick.color": INK,
        "ytick.color": INK,
        "font.size": 8.5,
    }
    with mpl.rc_context(style):
        figure = Figure(figsize=(3.7, 1.9), layout="constrained")
        figure.patch.set_visible(False)
        _draw(figure.add_subplot(), histogram, colours)
        buffer = StringIO()
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(buffer, format="svg", metadata=nothing)
    return _for_page(buffer.getvalue(), histogram.quantity.column)


def _draw(axes: Axes, histogram: RowHistogram, colours: Mapping[str, str]) -> None:
    for split, counts in histogram.counts.items():
        share = counts / max(1, counts.sum())
        axes.stairs(share, histogram.edges, fill=True, color=colours[split], alpha=0.2)
        axes.stairs(share, histogram.edges, color=colours[split], lw=1.2)
    axes.set_xlabel(histogram.quantity.label)
    axes.ticklabel_format(axis="x", useOffset=False)
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=(1, 2, 5, 10)))
    axes.set_xlim(histogram.edges[0], histogram.edges[-1])
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    axes.yaxis.set_major_locator(MaxNLocator(3))
    axes.patch.set_visible(False)
    axes.spines[["top", "right"]].set_visible(False)


def _for_page(svg: str, name: str) -> Markup:
    """The <svg> element alone, without namespaces, which HTML does not need; ids made unique."""
    element = svg[svg.index("<svg") :]
    element = re.sub(r'\sxmlns(:\w+)?="[^"]*"', "", element)
    element = re.sub(r"<metadata>.*?</metadata>", "", element, flags=re.DOTALL)
    element = re.sub(r'\sid="', f' id="{name}-', element)
    element = re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>{name}-", element)
    element = element.replace("xlink:href", "href").replace(INK, "currentColor")
    return Markup(element)  # noqa: S704
