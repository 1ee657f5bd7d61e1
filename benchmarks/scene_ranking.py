"""What PointNet can learn from the clouds of a field, with and without the ranking loss.

Only the point branch and (v, omega) themselves, joined by a small dense network: no picture, no
history, no drawing of the trajectory. It says what is lost elsewhere, and takes a few minutes.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import binary_cross_entropy_with_logits

from benchmarks.candidate_truth import rank
from benchmarks.publish import publish
from graspe_data.shards import Dataset
from model_zoo.layers.point_input import bounded, choose_points
from model_zoo.layers.pointnet import PointNet, PointNetSettings
from model_zoo.training.candidates import ranking_loss

COLUMNS = ("points", "point_count", "candidate_velocity", "candidate_success")
BATCH, POINTS, HALF_RANGE = 16, 1024, 3.0
FEATURES, TRAJECTORY, HORIZON = 40, 20, 10


@dataclass(frozen=True)
class Scenes:
    """Clouds (N, P, 3), metres; velocities (N, K, 2), m/s and rad/s; success (N, K, T)."""

    clouds: Tensor
    velocities: Tensor
    success: Tensor


class PointsAndVelocity(nn.Module):
    """Log-odds of success (B K, T) of K velocities in each of B clouds."""

    def __init__(self) -> None:
        """Make the layers of preset ``small``."""
        super().__init__()
        sizes = PointNetSettings(
            channels=(32, 64, 256), hidden=(128, 64), align_input=False, align_features=False
        )
        self.points = PointNet(FEATURES, sizes)
        self.velocity = nn.Sequential(nn.Linear(2, 32), nn.ReLU(), nn.Linear(32, TRAJECTORY))
        joined = FEATURES + TRAJECTORY
        self.head = nn.Sequential(
            nn.BatchNorm1d(joined), nn.Linear(joined, 128), nn.ReLU(), nn.Linear(128, HORIZON)
        )

    def forward(self, clouds: Tensor, velocities: Tensor) -> Tensor:
        """Score velocities (B, K, 2) in clouds (B, P, 3)."""
        scene = self.points(bounded(clouds, HALF_RANGE)).vector
        repeated = scene.repeat_interleave(velocities.shape[1], dim=0)
        by_velocity = self.velocity(velocities.flatten(0, 1))
        return self.head(torch.cat((repeated, by_velocity), dim=1))  # type: ignore[no-any-return]


def read_scenes(data: Path, split: str, every: int) -> Scenes:
    """Read every so many rows of a split."""
    dataset = Dataset(data, split, COLUMNS, check="sha256")
    rows = np.arange(0, len(dataset), every)
    parts = [dataset.batch(rows[start : start + 256]) for start in range(0, len(rows), 256)]
    clouds = [
        choose_points(torch.from_numpy(p["points"]), torch.from_numpy(p["point_count"]), POINTS)
        for p in parts
    ]
    velocities, success = (
        torch.from_numpy(np.concatenate([part[name] for part in parts])).float()
        for name in COLUMNS[2:]
    )
    return Scenes(torch.cat(clouds), velocities, success)


def train(scenes: Scenes, ranking: float, steps: int, seed: int) -> PointsAndVelocity:
    """Train with cosine learning rate; half of the scenes of a batch are seen in a mirror."""
    torch.manual_seed(seed)
    model, draw = PointsAndVelocity().train(), np.random.default_rng(seed)
    adam = torch.optim.AdamW(model.parameters(), 2e-3, weight_decay=1.5e-4)
    decay = torch.optim.lr_scheduler.CosineAnnealingLR(adam, steps)
    for clouds, velocities, success in _batches(scenes, draw, steps):
        logits = model(clouds, velocities)
        target = success.flatten(0, 1)
        loss = binary_cross_entropy_with_logits(logits, target)
        loss = loss + ranking * ranking_loss(logits, target, target >= 0, len(clouds))
        adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(model.parameters(), 5.0)
        adam.step()
        decay.step()
    return model.eval()


def _batches(
    scenes: Scenes, draw: np.random.Generator, steps: int
) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    for _ in range(steps):
        rows = torch.from_numpy(draw.integers(0, len(scenes.clouds), BATCH))
        side = torch.from_numpy(np.where(draw.random(BATCH) < 0.5, -1.0, 1.0)).float()
        clouds, velocities = scenes.clouds[rows].clone(), scenes.velocities[rows].clone()
        clouds[..., 1] *= side[:, None]
        velocities[..., 1] *= side[:, None]
        yield clouds, velocities, scenes.success[rows]


def least_success(model: PointsAndVelocity, scenes: Scenes) -> NDArray[np.float64]:
    """min(E) of each velocity, (N, K)."""
    number = scenes.velocities.shape[1]
    with torch.inference_mode():
        scores = [
            torch.sigmoid(model(*pair).double()).min(dim=1).values.view(-1, number)
            for pair in zip(
                torch.split(scenes.clouds, BATCH),
                torch.split(scenes.velocities, BATCH),
                strict=True,
            )
        ]
    return torch.cat(scores).double().numpy()


def main() -> int:
    """Train with each weight of the ranking loss and number of steps, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="a dataset of `make field`")
    parser.add_argument("--steps", type=int, nargs="+", default=[600, 1500])
    parser.add_argument("--ranking", type=float, nargs="+", default=[0.0, 1.0])
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    torch.set_flush_denormal(True)
    training, examined = (
        read_scenes(arguments.data, "train", 1),
        read_scenes(arguments.data, "validation", 2),
    )
    through = examined.success.bool().all(dim=2).numpy()
    lines = ["| ranking | steps | AU-ROC, all | within a scene | seconds |", "|" + " --- |" * 5]
    for ranking in arguments.ranking:
        for steps in arguments.steps:
            begun = time.perf_counter()
            model = train(training, ranking, steps, seed=0)
            took = time.perf_counter() - begun
            area = rank(through, least_success(model, examined))
            lines.append(
                f"| {ranking:g} | {steps} | {area.pooled:.3f} | {area.within:.3f} | {took:.0f} |"
            )
            sys.stderr.write(lines[-1] + "\n")
    publish(lines, arguments.out)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
