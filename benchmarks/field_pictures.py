"""Pictures of the simulated field side by side: one place by light, and clouds by structure."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.field_premise import CONDITIONS, FIRST_SEED, DriveMoment, changed, moments
from graspe_data.simulation.camera.lens_cover import LensCover
from graspe_data.simulation.scenario import load_scenario
from graspe_data.simulation.simulated_drive import simulate_drive


@dataclass(frozen=True)
class Shot:
    """Which moment of a scenario to show: in tall grass or not, at which rank of r_point."""

    scenario: str
    title: str
    in_grass: bool = False
    rank: float = 0.5


SHOTS = (
    Shot("yard", "between walls"),
    Shot("woodland", "among trunks"),
    Shot("graspe_3_tall_grass", "in tall grass", in_grass=True),
    Shot("graspe_2_hanging_leaves", "under hanging leaves", rank=0.1),
)
NOT_SHOWN = ("lens covered by half",)
REACH_M = 12.0
WIDTH_IN = 12.0
DRIVE_S = 60.0


def light_figure() -> Figure:
    """The same moment of the same drive under each condition of the camera."""
    figure, axes = _grid(2, 3, 6.4)
    scenario, robot = load_scenario("meadow")
    shown = [condition for condition in CONDITIONS if condition.name not in NOT_SHOWN]
    for axis, condition in zip(axes, shown, strict=True):
        simulated = simulate_drive(changed(scenario, condition, 12.0), robot, FIRST_SEED)
        cover = LensCover(condition.cover, FIRST_SEED) if condition.cover else None
        moment = next(iter(moments(simulated, cover)))
        axis.imshow(moment.picture)
        axis.set_title(f"{condition.name}: r_img {moment.r_img:.2f}", fontsize=10)
    return figure


def structure_figure() -> Figure:
    """Scenes of falling structure: the picture above, its cloud from above below."""
    figure, axes = _grid(2, len(SHOTS), 5.6)
    for column, scene in enumerate(SHOTS):
        moment = _moment(scene)
        axes[column].imshow(moment.picture)
        axes[column].set_title(scene.title, fontsize=10)
        _from_above(axes[len(SHOTS) + column], moment)
    return figure


def _moment(scene: Shot) -> DriveMoment:
    scenario, robot = load_scenario(scene.scenario)
    longer = scenario.model_copy(update={"duration_s": DRIVE_S})
    seen = [
        moment
        for moment in moments(simulate_drive(longer, robot, FIRST_SEED))
        if moment.in_grass == scene.in_grass
    ]
    return sorted(seen, key=lambda moment: moment.r_point)[int(scene.rank * len(seen))]


def _from_above(axis: Axes, moment: DriveMoment) -> None:
    points = moment.points
    ahead = points["x"] > 0
    axis.scatter(
        -points["y"][ahead],
        points["x"][ahead],
        c=points["intensity"][ahead],
        s=0.4,
        cmap="viridis",
        vmin=0,
        vmax=255,
        linewidths=0,
    )
    axis.set_xlim(-REACH_M / 1.5, REACH_M / 1.5)
    axis.set_ylim(0, REACH_M)
    axis.set_aspect("equal")
    axis.set_title(f"r_point {moment.r_point:.2f}", fontsize=10)


def _grid(rows: int, columns: int, height_in: float) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(WIDTH_IN, height_in), dpi=90, facecolor="white", layout="tight")
    FigureCanvasAgg(figure)
    axes = [figure.add_subplot(rows, columns, index + 1) for index in range(rows * columns)]
    for axis in axes:
        axis.set_xticks([])
        axis.set_yticks([])
    return figure, axes


def main() -> None:
    """Write ``field_light.png`` and ``field_structure.png`` into a folder."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "docs")
    light_figure().savefig(out / "field_light.png")
    structure_figure().savefig(out / "field_structure.png")


if __name__ == "__main__":
    main()
