"""How much does each sensor tell a model? Each in turn is that of another scene.

A model that asks its camera little loses little when the camera fails, whatever its reliability
says. The AU-ROC over candidates, and within a scene, that a strange column costs.
"""

from __future__ import annotations

import sys

import numpy as np

from benchmarks.candidate_truth import Ranking, known, least_success, rank, read_arguments
from benchmarks.publish import publish
from graspe_data.shards import Dataset
from model_zoo.checkpoints import load_checkpoint

SENSORS = {
    "camera": ("image", "r_img"),
    "lidar": ("points", "point_count", "r_point", "laser_scan"),
    "odometry": ("velocity_history",),
}


def main() -> int:
    """Ask every checkpoint given with one sensor at a time from elsewhere, and store the table."""
    arguments = read_arguments(__doc__, every=2)
    count = len(Dataset(arguments.data, arguments.split, ("r_img",), check="sha256"))
    rows = np.arange(0, count, arguments.every)
    others = np.random.default_rng(0).permutation(rows)
    rows_of_split = arguments.data, arguments.split, rows
    through = known(*rows_of_split)
    lines = [HEADING]
    for path in arguments.checkpoints:
        checkpoint = load_checkpoint(path)
        own = rank(through, least_success(checkpoint, *rows_of_split))
        cells = [f"{own.pooled:.3f}, {own.within:.3f}"]
        for columns in SENSORS.values():
            strange = [name for name in columns if name in checkpoint.model.columns]
            judged = rank(through, least_success(checkpoint, *rows_of_split, strange, others))
            cells.append(_lost(own, judged) if strange else "-")
        lines.append(f"| {checkpoint.config.model} ({path.parent.name}) | {' | '.join(cells)} |")
        sys.stderr.write(lines[-1] + "\n")
    publish(lines, arguments.out)
    return 0


def _lost(own: Ranking, strange: Ranking) -> str:
    return f"{own.pooled - strange.pooled:+.3f}, {own.within - strange.within:+.3f}"


HEADING = (
    "| model | AU-ROC of candidates: all, within a scene | lost with a strange "
    + " | ".join(SENSORS)
    + " |\n| --- | --- |"
    + " --- |" * len(SENSORS)
)

if __name__ == "__main__":
    raise SystemExit(main())
