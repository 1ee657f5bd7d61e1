"""The picture of one row: what the robot saw, where it was going, and how that went."""

from __future__ import annotations

from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from graspe_data.atomic_file import write_atomically
from graspe_data.observation.catalogue import RELIABILITIES
from graspe_data.shards.dataset import Dataset
from pipelines.report.row_scene import (
    SCENE_COLUMNS,
    RowScene,
    row_scene,
    scan_points,
)

ARC = "#ff7f0e"
AHEAD = "#ffc27d"
SCAN = "#d62728"
INK = "#222222"
FAINT = "#8a8a8a"
BARS = {"r_img": "#1f77b4", "r_point": "#2ca02c"}
STEP_COLOURS = {"success": "#2ca02c", "failure": "#d62728", "not judged": "#bdbdbd"}
WIDTH_IN, HEIGHT_IN = 13.6, 5.0
AHEAD_M, BEHIND_M, ASIDE_M = 20.0, 3.0, 11.5
NS_PER_S = 1e9
SMALL = 8


def write_row_picture(folder: Path, split: str, row: int, picture: Path, dpi: int = 110) -> None:
    """Write the picture of one row of a dataset as a PNG.

    Args:
        folder: The dataset's folder.
        split: Such as ``train``.
        row: Index of the row in the split.
        picture: The file to write.
        dpi: Pixels an inch; the picture is 13.6 x 5.0 inches.

    Raises:
        ShardError: No valid dataset there, or the picture cannot be written.
        IndexError: The split has no such row.
    """
    dataset = Dataset(folder, split, SCENE_COLUMNS)
    scene = row_scene(dataset.index, dataset.row(row))
    write_atomically(picture, [draw_row(scene, f"{split} row {row}", dpi)])


def draw_row(scene: RowScene, name: str, dpi: int = 100) -> bytes:
    """Draw a row as a PNG of 13.6 x 5.0 inches.

    Args:
        scene: The row.
        name: What to call it, such as ``train row 12``; printable ASCII.
        dpi: Pixels an inch.
    """
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=dpi, facecolor="white")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(
        4,
        3,
        width_ratios=(1.32, 1.0, 0.78),
        height_ratios=(0.9, 0.9, 1.25, 0.3),
        left=0.008,
        right=0.965,
        top=0.83,
        bottom=0.1,
        wspace=0.17,
        hspace=0.62,
    )
    _heading(figure, scene, name)
    _picture(figure.add_subplot(grid[:, 0]), scene)
    _from_above(figure.add_subplot(grid[:, 1]), scene)
    upper = figure.add_subplot(grid[0, 2])
    _velocity(upper, scene, 0, "speed, m/s")
    upper.tick_params(labelbottom=False)
    _velocity(figure.add_subplot(grid[1, 2]), scene, 1, "yaw rate, rad/s")
    _reliabilities(figure.add_subplot(grid[2, 2]), scene)
    _steps(figure.add_subplot(grid[3, 2]), scene)
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def _heading(figure: Figure, scene: RowScene, name: str) -> None:
    row, (v, omega) = scene.row, scene.velocity
    seconds, nanoseconds = divmod(int(row["stamp_ns"]), int(NS_PER_S))
    when = datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M:%S")
    ages = ", ".join(
        f"{sensor} {int(row[column]) / 1e6:+.0f} ms"
        for sensor, column in (("cloud", "points_age_ns"), ("odometry", "odometry_age_ns"))
    )
    since = "" if scene.time_s is None else f"t = {scene.time_s:.1f} s   |   "
    title = f"{_printable(scene.recording)}   |   {name}"
    detail = (
        f"{since}{when}.{nanoseconds // 1_000_000:03d} UTC   |   age at the picture: {ages}   |   "
        f"{v:.2f} m/s, {omega:+.2f} rad/s"
    )
    figure.text(0.008, 0.945, title, size=11, weight="bold", color=INK, parse_math=False)
    figure.text(0.008, 0.9, detail, size=SMALL + 0.5, color="#555555", parse_math=False)


def _printable(name: str, longest: int = 70) -> str:
    """A stranger's name in characters that the font has, cut to a line."""
    plain = "".join(c if " " <= c <= "~" else "?" for c in name)
    return plain if len(plain) <= longest else f"{plain[: longest - 3]}..."


def _title(axes: Axes, text: str) -> None:
    axes.set_title(text, size=SMALL + 0.5, loc="left", color=INK, pad=4)


def _picture(axes: Axes, scene: RowScene) -> None:
    image = scene.row["image"]
    height, width = image.shape[:2]
    axes.imshow(image, interpolation="bilinear", extent=(0, width, height, 0))
    for mask, colour, alpha, line in (
        (scene.ribbon, ARC, 0.5, "solid"),
        (scene.ribbon_ahead, AHEAD, 0.35, "dashed"),
        (scene.ribbon_beyond, AHEAD, 0.12, "dashed"),
    ):
        if mask.any():
            outline = np.pad(mask, 1).astype(float)
            x, y = np.arange(-1, width + 1) + 0.5, np.arange(-1, height + 1) + 0.5
            axes.contourf(x, y, outline, levels=(0.5, 1.5), colors=[colour], alpha=alpha)
            axes.contour(x, y, outline, levels=(0.5,), colors=[colour], linestyles=line)
    axes.set(xlim=(0, width), ylim=(height, 0), xticks=[], yticks=[])
    _title(axes, f"picture, {width} x {height}, and the ground the trajectory covers")
    axes.set_xlabel(_picture_note(scene), size=SMALL, color="#555555", loc="left", labelpad=5)


def _picture_note(scene: RowScene) -> str:
    reach = float(np.hypot(*scene.arc[-1, :2]))
    if scene.picture_shows_arc:
        return "orange: the predicted trajectory"
    where = f"the trajectory ends {reach:.1f} m from base_link, outside the picture"
    if scene.ribbon_ahead.any() or scene.ribbon_beyond.any():
        where += f"; dashed: the same arc\ncontinued to {scene.continued_to:.0f} m"
    if scene.ribbon_beyond.any():
        where += ", fainter from the first obstacle in the laser scan on"
    return where


def _from_above(axes: Axes, scene: RowScene) -> None:
    """Draw the cloud, scan and arc: forward is up, left is left, metres."""
    points, intensity = scene.row["points"], scene.row["intensity"]
    shown = np.isfinite(points).all(axis=1)
    colours = np.nan_to_num(intensity[shown], nan=0.5)
    x, y, _ = points[shown].T
    axes.scatter(-y, x, c=colours, s=1.2, cmap="viridis", vmin=0, vmax=1, linewidths=0)
    scan = scan_points(scene.row["laser_scan"], scene.recipe)
    axes.plot(-scan[:, 1], scan[:, 0], ".", ms=2.4, color=SCAN, label="laser scan")
    _footprint(axes, scene)
    axes.plot(-scene.arc[:, 1], scene.arc[:, 0], ".-", color=ARC, lw=2, ms=4, label="trajectory")
    if len(scene.ahead):
        axes.plot(
            -scene.ahead[:, 1], scene.ahead[:, 0], "--", color=AHEAD, lw=1.6, label="continued"
        )
    axes.set(xlim=(-ASIDE_M, ASIDE_M), ylim=(-BEHIND_M, AHEAD_M), aspect="equal")
    axes.set_xticks((-10, -5, 0, 5, 10), ("10", "5", "0", "-5", "-10"))
    axes.grid(color="#e8e8e8", lw=0.6)
    axes.set_axisbelow(True)
    _plain(axes)
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.045),
        fontsize=SMALL - 0.5,
        frameon=False,
        handletextpad=0.4,
        ncols=3,
    )
    _title(axes, f"{np.count_nonzero(shown):,} points from above, by intensity; metres")


def _footprint(axes: Axes, scene: RowScene) -> None:
    """The robot, centred on base_link."""
    size = scene.recipe.robot.footprint
    corner = (-size.width / 2, -size.length / 2)
    axes.add_patch(
        Rectangle(corner, size.width, size.length, facecolor="#44444455", edgecolor=INK, lw=1)
    )


def _velocity(axes: Axes, scene: RowScene, which: int, text: str) -> None:
    values = scene.row["velocity_history"][:, which]
    step = scene.recipe.dataset.window.history_step_s
    times = (np.arange(len(values)) - len(values) + 1) * step
    axes.plot(times, values, color=ARC, lw=1.5)
    axes.axhline(0, color="#d0d0d0", lw=0.7, zorder=0)
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    room = max(0.12 * (high - low), 0.05)
    axes.set(xlim=(times[0], 0), ylim=(low - room, high + room))
    _plain(axes)
    _title(axes, text + ("" if which else f", the last {-times[0]:.1f} s"))


def _reliabilities(axes: Axes, scene: RowScene) -> None:
    for place, name in enumerate(RELIABILITIES):
        value = float(scene.row[name])
        bold = "bold" if name in BARS else "normal"
        axes.barh(-place, 1, color="#f1f1f1", height=0.66)
        axes.barh(-place, value, color=BARS.get(name, "#a9b8c4"), height=0.66)
        axes.text(1.03, -place, f"{value:.2f}", size=SMALL, va="center", color=INK, weight=bold)
        axes.text(-0.03, -place, name, size=SMALL, va="center", ha="right", weight=bold)
    axes.set(xlim=(0, 1), xticks=[], yticks=[])
    axes.set_frame_on(False)
    _title(axes, "reliability")


def _steps(axes: Axes, scene: RowScene) -> None:
    success, mask = scene.row["success"], scene.row["success_mask"]
    step_s = scene.recipe.dataset.horizon.step_s
    kinds = np.where(mask, np.where(success == 1, "success", "failure"), "not judged").tolist()
    colours = [STEP_COLOURS[kind] for kind in kinds]
    axes.bar(np.arange(len(kinds)) + 0.5, 1, width=0.92, color=colours)
    ends = (0, len(kinds))
    axes.set(xlim=ends, ylim=(0, 1), yticks=[])
    axes.set_xticks(ends, [f"{end * step_s:.1f} s" for end in ends])
    axes.tick_params(labelsize=SMALL - 0.5, length=0, colors=FAINT)
    axes.set_frame_on(False)
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in STEP_COLOURS if kind in kinds)
    _title(axes, f"{len(kinds)} steps: {counts}")


def _plain(axes: Axes) -> None:
    axes.tick_params(labelsize=SMALL - 0.5, length=2, colors="#555555")
    for side in axes.spines.values():
        side.set_color("#cccccc")
