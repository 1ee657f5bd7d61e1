"""Trials from above: the world of a seed, and the ways that methods took through it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Rectangle

from graspe_data.arrays import Floats
from graspe_data.atomic_file import write_atomically
from graspe_data.errors import StageError
from graspe_data.manifest import load_manifest
from graspe_data.simulation.field import scenario_world
from graspe_data.simulation.world.materials import MATERIAL_NAMES, MaterialName
from graspe_data.simulation.world.obstacles import Obstacles
from graspe_data.simulation.world.world import World
from pipelines.trials.config import Conditions
from pipelines.trials.run_trials import CONDITIONS_FILE
from pipelines.trials.trial import Trial, read_trial

METHOD_COLOURS: Final = (
    "#d55e00",
    "#0072b2",
    "#cc79a7",
    "#000000",
    "#e69f00",
    "#56b4e9",
    "#7f3c8d",
)
"""Of Okabe and Ito, but green, which plants have; the last is for a seventh method.
More are dashed."""
COLOURS: Final[dict[MaterialName, str]] = {
    "grass": "#dcebb5",
    "bush": "#6d9a4a",
    "vine": "#8fae6b",
    "bark": "#6b4a2f",
    "wood": "#a9814f",
    "rock": "#9a9a94",
    "glass": "#9fd3dd",
}
OTHER: Final = "#7d7a76"
HANGING: Final[dict[MaterialName, str]] = {"hanging_leaf": "#3f9f8f", "bead": "#b06a80"}
HANGS_BELOW: Final = 2.0
"""Metres; what hangs higher is not in the robot's way."""
DOTS: Final = 4000
ROUND: Final = 24
WIDTH_IN, DOTS_PER_INCH = 10.0, 130


def write_trial_picture(out: Path, scenario: str, seed: int, file: Path) -> Path:
    """Draw all trials of a scenario and a seed that a folder holds, as PNG.

    Args:
        out: The folder of `graspe navigate run`.
        scenario: Its name.
        seed: Of the world.
        file: The picture to write.

    Raises:
        StageError: There are no such trials, or the file cannot be written.
        ManifestError: ``conditions.json`` is damaged.
    """
    trials = [read_trial(path) for path in sorted((out / scenario).glob(f"*/{seed}.json"))]
    if not trials:
        raise StageError(f"{out / scenario}: no trials of seed {seed} there.")
    conditions = load_manifest(out / scenario / CONDITIONS_FILE, Conditions)
    world = scenario_world(conditions.scenario, seed)
    radius = conditions.trial.goal_radius
    write_atomically(file, [draw_trials(world, trials, radius)], StageError)
    return file


def draw_trials(world: World, trials: Sequence[Trial], goal_radius: float) -> bytes:
    """A PNG of the world from above with the way of each trial; x to the right, y up, metres."""
    low_x, low_y, high_x, high_y = world.arena
    height = WIDTH_IN * (high_y - low_y + 2) / (high_x - low_x + 2) + 1.0
    figure = Figure(figsize=(WIDTH_IN, height), dpi=DOTS_PER_INCH, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.add_patch(Rectangle((low_x, low_y), high_x - low_x, high_y - low_y, fill=False, lw=0.8))
    shown = [*_draw_obstacles(axes, world.obstacles), *_draw_curtains(axes, world)]
    looks = itertools.product(("-", "--", ":"), METHOD_COLOURS)
    lines = [_draw_way(axes, trial, *look) for trial, look in zip(trials, looks, strict=False)]
    _draw_ends(axes, trials[0], goal_radius)
    axes.set(xlim=(low_x - 1, high_x + 1), ylim=(low_y - 1, high_y + 1), aspect="equal")
    axes.set(xlabel="x, m", ylabel="y, m", title=f"{trials[0].scenario}, seed {trials[0].seed}")
    figure.legend(handles=[*lines, *shown], loc="outside lower center", ncols=4, fontsize=8)
    content = BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None})
    return content.getvalue()


def _draw_obstacles(axes: Axes, obstacles: Obstacles) -> list[Patch]:
    """Footprints by material, what slows below what stops; returns the legend's entries."""
    standing = set(obstacles.material) - HANGING.keys()
    names = sorted(standing, key=lambda name: (name != "grass", name))
    for name in names:
        rows = [row for row, material in enumerate(obstacles.material) if material == name]
        outlines = [_outline(obstacles, row) for row in rows]
        axes.add_collection(PolyCollection(outlines, facecolors=COLOURS.get(name, OTHER)))
    return [Patch(facecolor=COLOURS.get(name, OTHER), label=_called(name)) for name in names]


def _draw_curtains(axes: Axes, world: World) -> list[Line2D]:
    """What hangs down and gives way: a dot for some of its triangles."""
    entries = []
    corners = world.surfaces.vertices[world.surfaces.faces[:, 0]]
    for name, colour in HANGING.items():
        of_material = world.surfaces.material == MATERIAL_NAMES.index(name)
        rows = np.flatnonzero(of_material & (corners[:, 2] < HANGS_BELOW))
        if len(rows):
            kept = corners[rows[:: -(-len(rows) // DOTS)]]
            (line,) = axes.plot(kept[:, 0], kept[:, 1], ".", color=colour, markersize=2.5)
            line.set_label(_called(name))
            entries.append(line)
    return entries


def _outline(obstacles: Obstacles, row: int) -> Floats:
    """The capsule's edge (2 ROUND, 2)."""
    start, end, radius = obstacles.start[row], obstacles.end[row], obstacles.radius[row]
    along = end - start
    heading = np.arctan2(along[1], along[0])
    angles = np.linspace(-np.pi / 2, np.pi / 2, ROUND) + heading
    rim = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.concatenate([end + rim, start - rim])


def _draw_way(axes: Axes, trial: Trial, style: str, colour: str) -> Line2D:
    way = np.array(trial.path)
    label = f"{trial.method}: {trial.outcome.replace('_', ' ')}"
    (line,) = axes.plot(way[:, 0], way[:, 1], style, color=colour, linewidth=1.6, label=label)
    if not trial.success:
        axes.plot(*way[-1, :2], marker="X", markersize=9, color=colour, markeredgecolor="white")
    return line


def _draw_ends(axes: Axes, trial: Trial, goal_radius: float) -> None:
    x, y, yaw = trial.start
    axes.annotate(
        "",
        (x + 1.2 * np.cos(yaw), y + 1.2 * np.sin(yaw)),
        (x, y),
        arrowprops={"arrowstyle": "-|>", "lw": 1.5},
    )
    axes.annotate("start", (x, y), (0, -12), textcoords="offset points", ha="center", fontsize=8)
    axes.add_patch(Circle(trial.goal, goal_radius, fill=False, lw=1.5))
    axes.plot(*trial.goal, marker="*", markersize=10, color="black")
    axes.annotate("goal", trial.goal, (0, -16), textcoords="offset points", ha="center", fontsize=8)


def _called(name: str) -> str:
    called = {"bark": "tree", "grass": "tall grass", "hanging_leaf": "leaves", "bead": "beads"}
    return called.get(name, name)
