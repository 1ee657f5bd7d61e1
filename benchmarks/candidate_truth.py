"""Do models rank candidates in the same scene as the simulated world would?

A test row has one trajectory, the one that was driven. A planner asks about many in one scene; the
world knows how each would have ended.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.metrics import roc_auc_score

from graspe_data.observation.laser_scan import LaserScanSettings
from graspe_data.shards import Dataset
from graspe_data.simulation.message_stream import START_NS
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.scenario import load_scenario
from graspe_data.simulation.simulated_drive import simulate_drive
from graspe_data.simulation.truth.outlook import arc_success
from model_zoo.checkpoints import Checkpoint, load_checkpoint
from pipelines.candidates.scored_scene import candidate_lattice, draw_candidates
from pipelines.report.row_scene import SCENE_COLUMNS, row_scene
from planners.arc_distance import free_way
from planners.body_discs import BodySettings, body_discs
from planners.obstacles import scan_points

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

HORIZON_S = 3.0


@dataclass(frozen=True)
class Asked:
    """A row, its candidates drawn, and which of them get through.

    ``row`` index in the split. ``images`` (K, H, W). ``success`` (K, T). ``free_s`` (K,): until
    the candidate meets something in the laser scan, at most the horizon.
    """

    row: int
    images: Bools
    success: Bools
    free_s: Floats


@dataclass(frozen=True)
class Ranking:
    """How a model ranks candidates by min(E).

    ``pooled``: AU-ROC over all candidates of all scenes. ``within``: the mean over the scenes of
    the AU-ROC among their own candidates. ``first``: share of scenes whose best-scored candidate
    gets through; ``chance``: of all candidates. ``spread``: mean standard deviation in a scene.
    """

    pooled: float
    within: float
    first: float
    chance: float
    spread: float
    scenes: int


def main() -> int:
    """Rank the candidates of a split's rows by every checkpoint given, and store the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkpoints", type=Path, nargs="+")
    parser.add_argument("--data", type=Path, required=True, help="a dataset of `make field`")
    parser.add_argument("--split", default="validation")
    parser.add_argument("--every", type=int, default=20, help="of a recording's rows")
    parser.add_argument("--duration", type=float, default=60.0, help="of the drives, s")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    asked = list(scenes(arguments.data, arguments.split, arguments.every, arguments.duration))
    by_scan = rank(asked, [scene.free_s for scene in asked])
    lines = [HEADING, _line("free way in the laser scan, no model", by_scan)]
    for path in arguments.checkpoints:
        checkpoint = load_checkpoint(path)
        dataset = Dataset(arguments.data, arguments.split, tuple(checkpoint.model.columns))
        ranked = rank(asked, [_least(checkpoint, dataset, scene) for scene in asked])
        lines.append(_line(f"{checkpoint.config.model} ({path.parent.name})", ranked))
        sys.stderr.write(lines[-1] + "\n")
    table = "\n".join(lines) + "\n"
    sys.stdout.write(table)
    if arguments.out:
        arguments.out.write_text(table)
    return 0


def scenes(data: Path, split: str, every: int, duration_s: float) -> Iterator[Asked]:
    """Rows of a split with what the world says of their candidates; the drives are driven anew."""
    dataset = Dataset(data, split, SCENE_COLUMNS)
    labels = Dataset(data, split, ("recording", "stamp_ns")).batch(np.arange(len(dataset)))
    for recording in np.unique(labels["recording"]).tolist():
        rows = np.flatnonzero(labels["recording"] == recording)
        rows = rows[np.argsort(labels["stamp_ns"][rows])][::every]
        name, _, seed = Path(dataset.index.recordings[recording].name).stem.rpartition("-")
        stamp_ns = labels["stamp_ns"][rows].astype(np.int64)
        yield from _of_drive(dataset, rows, stamp_ns, name, int(seed), duration_s)


def _of_drive(
    dataset: Dataset,
    rows: NDArray[np.int64],
    stamp_ns: NDArray[np.int64],
    name: str,
    seed: int,
    duration_s: float,
) -> Iterator[Asked]:
    scenario, robot = load_scenario(name)
    shorter = scenario.model_copy(update={"duration_s": duration_s})
    drive = simulate_drive(shorter, robot, seed, threads=1)
    steps = np.rint((stamp_ns - START_NS) / 1e9 / STEP_S).astype(int)
    velocities = candidate_lattice(robot.limits)
    body, images = body_discs(robot.footprint, BodySettings()), None
    for row, step in zip(rows.tolist(), steps.tolist(), strict=True):
        if images is None:
            images = draw_candidates(row_scene(dataset.index, dataset.row(row)), velocities)
        pose = (*drive.driven.position[step, :2], drive.driven.attitude[step, 2])
        poses = np.broadcast_to(pose, (len(velocities), 3))
        mechanics = scenario.motion.mechanics
        success = arc_success(drive.world, robot, poses, velocities, settings=mechanics)
        way = free_way(velocities, _scan(dataset, row), body).length
        yield Asked(row, images, success, np.minimum(way / velocities[:, 0], HORIZON_S))


def _scan(dataset: Dataset, row: int) -> Floats:
    scan = dataset.row(row)["laser_scan"].astype(np.float32)
    return scan_points(scan, LaserScanSettings().half_angle)


def rank(asked: Sequence[Asked], least: Sequence[Floats]) -> Ranking:
    """Hold the scores (K,) of each scene against the world.

    Scenes where all candidates or none get through count only in ``pooled``.
    """
    through = [scene.success.all(axis=1) for scene in asked]
    mixed = [(s, t) for s, t in zip(least, through, strict=True) if t.any() and not t.all()]
    return Ranking(
        pooled=float(roc_auc_score(np.concatenate(through), np.concatenate(least))),
        within=float(np.mean([roc_auc_score(t, s) for s, t in mixed])),
        first=float(np.mean([t.take(np.argmax(s)) for s, t in mixed])),
        chance=float(np.mean([t.mean() for _, t in mixed])),
        spread=float(np.mean([s.std() for s in least])),
        scenes=len(mixed),
    )


def _least(checkpoint: Checkpoint, dataset: Dataset, scene: Asked) -> Floats:
    """min(E) of each candidate, (K,)."""
    model = checkpoint.model.eval()
    columns = {name: torch.from_numpy(array) for name, array in dataset.batch([scene.row]).items()}
    held = {name: columns[name] for name in model.scene_columns}
    candidates = {name: columns[name] for name in model.candidate_columns if name in columns}
    if "trajectory_image" in candidates:
        candidates["trajectory_image"] = torch.from_numpy(scene.images)
    with torch.inference_mode():
        success = torch.sigmoid(model.score(model.encode(held), candidates)).numpy()
    return np.broadcast_to(success.min(axis=1), (len(scene.images),)).astype(np.float64)


HEADING = (
    "| model | AU-ROC, all candidates | within a scene | best one gets through | of all | spread | "
    "scenes |\n| --- | --- | --- | --- | --- | --- | --- |"
)


def _line(name: str, found: Ranking) -> str:
    return (
        f"| {name} | {found.pooled:.3f} | {found.within:.3f} | {found.first:.1%} | "
        f"{found.chance:.1%} | {found.spread:.3f} | {found.scenes} |"
    )


if __name__ == "__main__":
    raise SystemExit(main())
