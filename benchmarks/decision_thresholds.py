"""Which thresholds suit a field: e_th of the model's word, and r_th of the laser scan's.

GrASPE's planner drives an arc that the model accepts, min(E) >= e_th, and that the scan does not
bar; below r_th the scan is not asked (equation (8)). Whether an accepted arc gets through, and how
often no arc is left where one would get through, is known in the validation worlds.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.candidate_truth import known, least_success, read_arguments, scan_ways
from benchmarks.publish import publish
from graspe_data.arrays import Floats, Mask
from graspe_data.shards import Dataset
from model_zoo.checkpoints import load_checkpoint
from planners.arc_distance import admissible
from planners.graspe_planner import GraspePlannerSettings

BANDS = (0.0, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.8, 1.0)
E_TH = (0.5, 0.6, 0.7, 0.8, 0.9)
R_TH = (0.0, 0.3, 0.4, 0.5, 0.6, 1.0)
TRUSTED = 0.6
"""r_point above which the scan is right about most of the arcs that it bars."""
FINE = np.arange(50, 100) / 100
MOST_STRANDED = 0.1


def main() -> int:
    """Judge the thresholds for every checkpoint given, and store the tables."""
    arguments = read_arguments(__doc__, every=1)
    count = len(Dataset(arguments.data, arguments.split, ("r_point",), check="sha256"))
    rows = arguments.data, arguments.split, np.arange(0, count, arguments.every)
    through, (barred, r_point) = known(*rows), scan_bars(*rows)
    lines = ["# Thresholds of decision", "", LEGEND, ""]
    for path in arguments.checkpoints:
        checkpoint = load_checkpoint(path)
        least = least_success(checkpoint, *rows)
        lines += [f"## {checkpoint.config.model} ({path.parent.name})", ""]
        lines += [*_bands(through, barred, r_point, least), ""]
        lines += [*_grid(through, barred, r_point, least), ""]
        lines += [_fitted(through, barred, r_point, least), ""]
        sys.stderr.write(f"{path.parent.name}\n")
    publish(lines[:-1], arguments.out)
    return 0


def scan_bars(data: Path, split: str, rows: NDArray[np.int64]) -> tuple[Mask, Floats]:
    """Whether the scan bars each candidate (N, K), as the planner judges; and r_point (N,)."""
    ways, reaction_s = scan_ways(data, split, rows), GraspePlannerSettings().reaction_s
    admitted = [
        admissible(candidates, way, ways.robot.limits, reaction_s)
        for candidates, way in zip(ways.velocities, ways.free, strict=True)
    ]
    r_point = Dataset(data, split, ("r_point",), check="sha256").batch(rows)["r_point"]
    return ~np.stack(admitted), r_point.astype(np.float64)


def _bands(through: Mask, barred: Mask, r_point: Floats, least: Floats) -> list[str]:
    """Who is right where the model accepts at 0.5 and the scan bars, by r_point."""
    lines = [
        "| r_point | scenes | barred | accepted, barred | accepted, not barred |",
        "| --- | --- | --- | --- | --- |",
    ]
    accepted = least >= E_TH[0]
    for low, high in pairwise(BANDS):
        held = ((r_point >= low) & (r_point < high))[:, None]
        cells = [
            f"{int(np.count_nonzero(chosen))}, {_share(through[chosen])}"
            for chosen in (held & barred, held & barred & accepted, held & ~barred & accepted)
        ]
        lines.append(f"| {low:g} to {high:g} | {int(held.sum())} | {' | '.join(cells)} |")
    return lines


def _grid(through: Mask, barred: Mask, r_point: Floats, least: Floats) -> list[str]:
    """For each pair of thresholds: of the arcs left, those that get through; and scenes left."""
    heading = " | ".join(f"r_th {r_th:g}" for r_th in R_TH)
    lines = [f"| e_th | {heading} |", "| --- |" + " --- |" * len(R_TH)]
    for e_th in E_TH:
        cells = []
        for r_th in R_TH:
            left = (least >= e_th) & ~(barred & (r_point > r_th)[:, None])
            right = [row[kept].mean() for row, kept in zip(through, left, strict=True) if any(kept)]
            cells.append(f"{np.mean(right):.1%}, {_stranded(through, left):.1%}")
        lines.append(f"| {e_th:g} | {' | '.join(cells)} |")
    return lines


def _fitted(through: Mask, barred: Mask, r_point: Floats, least: Floats) -> str:
    """The highest e_th that strands the robot in no more scenes than may be.

    So fitted, models are compared at the same caution.
    """
    open_ways = ~(barred & (r_point > TRUSTED)[:, None])
    stranded = {e_th: _stranded(through, (least >= e_th) & open_ways) for e_th in FINE}
    fitting = [e_th for e_th, share in stranded.items() if share <= MOST_STRANDED]
    found = f"e_th {max(fitting):g}" if fitting else f"none from {FINE[0]:g} on"
    return f"At r_th {TRUSTED:g} the highest that leaves an arc in nine scenes of ten: {found}."


def _stranded(through: Mask, left: Mask) -> float:
    """Of the scenes where an arc gets through, the share in which none is left."""
    passable = through.any(axis=1)
    return float((~left.any(axis=1) & passable).sum() / passable.sum())


def _share(through: Mask) -> str:
    return f"{through.mean():.0%}" if through.size else "-"


LEGEND = (
    "Candidates of the validation worlds. First table: arcs that the scan bars (it could not "
    "stop in time) and that the model accepts at 0.5, and the share of them that get through. "
    "Second: of the arcs that a pair of thresholds leaves, the share that get through, as a mean "
    "over scenes; and of the scenes where an arc gets through, the share in which none is left. "
    "r_th 0 always asks the scan, 1 never."
)

if __name__ == "__main__":
    raise SystemExit(main())
