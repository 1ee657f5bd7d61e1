"""Do models rank candidates in the same scene as the simulated world would?

A test row has one trajectory, the one that was driven. A planner asks about many in one scene; the
world knows how each would have ended, and a dataset of the field keeps its answers.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.metrics import roc_auc_score

from benchmarks.publish import publish
from graspe_data.arrays import Floats, Mask
from graspe_data.observation.laser_scan import LaserScanSettings
from graspe_data.robot import Robot
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index
from model_zoo.checkpoints import Checkpoint, load_checkpoint
from model_zoo.evaluation.scenes import scene_areas
from planners.arc_distance import FreeWay, free_way
from planners.body_discs import BodySettings, body_discs
from planners.obstacles import scan_points

ASKED = ("candidate_velocity", "candidate_image", "candidate_success", "candidate_mask")
BATCH = 16


@dataclass(frozen=True)
class Ranking:
    """How candidates are ranked by min(E).

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
    arguments = read_arguments(__doc__, every=2)
    rows = np.arange(
        0, len(Dataset(arguments.data, arguments.split, ASKED, check="sha256")), arguments.every
    )
    through = known(arguments.data, arguments.split, rows)
    free = free_seconds(arguments.data, arguments.split, rows)
    lines = [HEADING, _line("slow and straight, no sensor", rank(through, free.blind))]
    lines.append(_line("free way in the laser scan, no model", rank(through, free.scan)))
    for path in arguments.checkpoints:
        checkpoint = load_checkpoint(path)
        least = least_success(checkpoint, arguments.data, arguments.split, rows)
        lines.append(_line(f"{checkpoint.config.model} ({path.parent.name})", rank(through, least)))
        sys.stderr.write(lines[-1] + "\n")
    publish(lines, arguments.out)
    return 0


def read_arguments(description: str | None, every: int) -> argparse.Namespace:
    """Checkpoints, the rows of a dataset to ask them about, and where the answers go."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("checkpoints", type=Path, nargs="+")
    parser.add_argument("--data", type=Path, required=True, help="a dataset of `make field`")
    parser.add_argument("--split", default="validation")
    parser.add_argument("--every", type=int, default=every, help="row of the split")
    parser.add_argument("--out", type=Path)
    return parser.parse_args()


def known(data: Path, split: str, rows: NDArray[np.int64]) -> Mask:
    """Whether each candidate gets through to its end, (N, K)."""
    batch = Dataset(data, split, ("candidate_success", "candidate_mask"), check="sha256").batch(
        rows
    )
    if not batch["candidate_mask"].all():
        raise SystemExit(f"{data}: rows without candidates")
    return np.asarray(batch["candidate_success"].astype(bool).all(axis=2))


@dataclass(frozen=True)
class ModelFreeRanks:
    """What ranks without a model, (N, K): the laser scan, and nothing but the velocity."""

    scan: Floats
    blind: Floats


@dataclass(frozen=True)
class Ways:
    """Candidates (N, K, 2), m/s and rad/s, and by the laser scan the free way of each scene's."""

    robot: Robot
    velocities: Floats
    free: list[FreeWay]


def scan_ways(data: Path, split: str, rows: NDArray[np.int64]) -> Ways:
    """How far each candidate gets until it meets something in its row's scan."""
    dataset = Dataset(data, split, ("laser_scan", "candidate_velocity"), check="sha256")
    robot = Robot.model_validate(dataset.index.configuration["robot"])
    body, batch = body_discs(robot.footprint, BodySettings()), dataset.batch(rows)
    velocities = batch["candidate_velocity"].astype(np.float64)
    half = LaserScanSettings().half_angle
    free = [
        free_way(candidates, scan_points(scan.astype(np.float32), half), body)
        for candidates, scan in zip(velocities, batch["laser_scan"], strict=True)
    ]
    return Ways(robot, velocities, free)


def free_seconds(data: Path, split: str, rows: NDArray[np.int64]) -> ModelFreeRanks:
    """Seconds until the candidate meets something in the scan, at most the horizon's."""
    ways = scan_ways(data, split, rows)
    v, omega = np.moveaxis(ways.velocities, -1, 0)
    free = np.stack([way.length for way in ways.free]) / v
    horizon = read_index(data).configuration["dataset"]["horizon"]  # type: ignore[call-overload,index]
    longest = float(horizon["steps"]) * float(horizon["step_s"])  # type: ignore[index,arg-type,call-overload]
    return ModelFreeRanks(np.minimum(free, longest), -v - np.abs(omega))


def rank(through: Mask, least: Floats) -> Ranking:
    """Hold the scores (N, K) against the world.

    Scenes where all candidates or none get through count only in ``pooled``.
    """
    mixed = [
        (score, truth)
        for score, truth in zip(least, through, strict=True)
        if truth.any() and not truth.all()
    ]
    return Ranking(
        pooled=float(roc_auc_score(through.ravel(), least.ravel())),
        within=float(np.nanmean(scene_areas(least, through, np.ones_like(through)))),
        first=float(np.mean([t.take(np.argmax(s)) for s, t in mixed])),
        chance=float(np.mean([t.mean() for _, t in mixed])),
        spread=float(least.std(axis=1).mean()),
        scenes=len(mixed),
    )


def least_success(
    checkpoint: Checkpoint,
    data: Path,
    split: str,
    rows: NDArray[np.int64],
    strange: Collection[str] = (),
    others: NDArray[np.int64] | None = None,
) -> Floats:
    """min(E) of each candidate, (N, K); the same for all of a scene where no trajectory is read.

    Columns that are ``strange`` are read from the rows ``others`` instead.
    """
    model = checkpoint.model.eval()
    drawn = "trajectory_image" in model.candidate_columns
    columns = tuple(name for name in model.columns if name != "trajectory_image")
    dataset = Dataset(data, split, (*columns, "candidate_image"), check="sha256")
    others = rows if others is None else others
    found = []
    for start in range(0, len(rows), BATCH):
        batch = dataset.batch(rows[start : start + BATCH])
        elsewhere = dataset.batch(others[start : start + BATCH]) if strange else {}
        batch |= {name: elsewhere[name] for name in strange}
        held = {name: torch.from_numpy(batch[name]) for name in columns}
        images = torch.from_numpy(batch["candidate_image"])
        scenes, number = images.shape[:2]
        observation = held | ({"trajectory_image": images.flatten(0, 1)} if drawn else {})
        with torch.inference_mode():
            scores = torch.sigmoid(model.logits(observation).double()).min(dim=1).values
        found.append(scores.view(scenes, -1).expand(-1, number).double().numpy())
    return np.concatenate(found)


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
