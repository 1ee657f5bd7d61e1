"""The picture of a scene with its scored candidates."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from graspe_data.arrays import Floats
from graspe_data.atomic_file import write_atomically
from graspe_data.observation.trajectory import constant_velocity_arc, ground_homography
from pipelines.candidates.scored_scene import ScoredScene
from pipelines.report.row_scene import scan_points

WIDTH_IN, HEIGHT_IN, DPI = 11.0, 4.6, 110
COLOURS = "RdYlGn"
POSES = 40
AHEAD_M, BEHIND_M, ASIDE_M = 4.5, 0.8, 2.6
SMALL = 8


def write_candidates_picture(scene: ScoredScene, picture: Path) -> None:
    """Draw a scene and the candidates in it, red to green by min(E), as a PNG."""
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    ahead, above = figure.subplots(1, 2, width_ratios=(1.45, 1.0))
    arcs = _arcs(scene)
    _in_picture(ahead, scene, arcs)
    _from_above(above, scene, arcs)
    colours = ScalarMappable(cmap=COLOURS)
    colours.set_clim(0, 1)
    bar = figure.colorbar(colours, ax=above, fraction=0.05, pad=0.02)
    bar.set_label("min(E), the least probability of success", size=SMALL)
    bar.ax.axhline(scene.acceptance, color="#222222", lw=1.2)
    figure.suptitle(_heading(scene), size=SMALL + 2, x=0.01, ha="left")
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    write_atomically(picture, [buffer.getvalue()])


def _heading(scene: ScoredScene) -> str:
    accepted = int(np.count_nonzero(scene.least >= scene.acceptance))
    row = scene.scene.row
    return (
        f"{scene.scene.recording}, {scene.name}: {scene.model} accepts {accepted} of "
        f"{len(scene.least)} candidates (e_th = {scene.acceptance:g}); "
        f"r_img {float(row['r_img']):.2f}, r_point {float(row['r_point']):.2f}"
    )


def _arcs(scene: ScoredScene) -> Floats:
    """Points (K, POSES + 1, 2) on the ground, base_link, the worst candidates first."""
    horizon = scene.scene.recipe.dataset.horizon
    v, omega = scene.velocities.T
    step_s = horizon.steps * horizon.step_s / POSES
    return constant_velocity_arc(v, omega, POSES, step_s)[..., :2]


def _draw(axes: Axes, scene: ScoredScene, lines: list[Floats]) -> None:
    """Lines of the candidates; what is accepted lies on top."""
    colours = ScalarMappable(cmap=COLOURS)
    colours.set_clim(0, 1)
    shades = colours.to_rgba(scene.least)
    for index in np.argsort(scene.least).tolist():
        axes.plot(*lines[index].T, color=shades[index], lw=1.8, solid_capstyle="round")


def _in_picture(axes: Axes, scene: ScoredScene, arcs: Floats) -> None:
    image = scene.scene.row["image"]
    height, width = image.shape[:2]
    axes.imshow(image, extent=(0, width, height, 0), interpolation="bilinear")
    _draw(axes, scene, [_pixels(scene, arc) for arc in arcs])
    axes.set(xlim=(0, width), ylim=(height, 0), xticks=[], yticks=[])
    axes.set_title(
        "the picture, and where each candidate leads on the ground", size=SMALL + 0.5, loc="left"
    )


def _pixels(scene: ScoredScene, arc: Floats) -> Floats:
    """Pixels (N, 2) of points on the ground; NaN behind the camera."""
    if scene.scene.camera is None:
        return np.full((len(arc), 2), np.nan)
    intrinsics, base_from_camera = scene.scene.camera
    to_pixels = ground_homography(
        intrinsics, base_from_camera, scene.scene.recipe.robot.base_height
    )
    carried = np.column_stack((arc, np.ones(len(arc)))) @ to_pixels.T
    depth = np.where(carried[:, 2:] > 0.05, carried[:, 2:], np.nan)  # noqa: PLR2004  (metres)
    return np.asarray(carried[:, :2] / depth)


def _from_above(axes: Axes, scene: ScoredScene, arcs: Floats) -> None:
    scan = scan_points(scene.scene.row["laser_scan"], scene.scene.recipe)
    axes.plot(-scan[:, 1], scan[:, 0], ".", ms=3, color="#444444")
    _draw(axes, scene, [np.column_stack((-arc[:, 1], arc[:, 0])) for arc in arcs])
    axes.set(xlim=(-ASIDE_M, ASIDE_M), ylim=(-BEHIND_M, AHEAD_M), aspect="equal")
    axes.set_title("from above, with the laser scan; metres", size=SMALL + 0.5, loc="left")
    axes.tick_params(labelsize=SMALL)
