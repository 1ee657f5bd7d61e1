"""A model of some numbers and a dataset of some rows; as a script, a training of both.

The script writes a line for every step, so that a test can end it at a step of its choice.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from graspe_data.columns import Column
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, write_index
from graspe_data.shards.shard_writer import write_shard
from model_zoo.contract import Features, Loss, Observation, SuccessModel
from model_zoo.training.machine import Machine
from model_zoo.training.optimisation import step_seed
from model_zoo.training.progress import TrainingProgress
from model_zoo.training.recipe import Recipe
from model_zoo.training.train import NamedModel, TrainingPlan, train_model

HORIZON = 3
ROWS = {"train": 24, "validation": 9}
MACHINE = Machine(device="cpu", workers=0, threads=1, tensorboard=False, state_every_steps=3)
RECIPE = Recipe(epochs=3, batch_size=4, learning_rate=0.01, patience=None)

Arrays = dict[str, NDArray[np.generic]]


class TinyModel(SuccessModel):
    """A hidden layer with dropout and batch normalisation; it notes the rows that it was taught."""

    columns: ClassVar[tuple[str, ...]] = ("velocity_history", "r_img")
    candidate_columns: ClassVar[tuple[str, ...]] = ("r_img",)

    def __init__(self, horizon: int = HORIZON, dropout: float = 0.3, norm: bool = True) -> None:
        super().__init__()
        self.horizon = horizon
        self.batches = 0
        self.taught: list[list[float]] = []
        self.net = nn.Sequential(
            nn.Linear(9, 16),
            nn.BatchNorm1d(16) if norm else nn.Identity(),
            nn.Tanh(),
            nn.Dropout(dropout),
            nn.Linear(16, horizon),
        )

    def begin_training(self, batches: int) -> None:
        self.batches = batches

    def encode(self, scene: Observation) -> Features:
        return {"history": scene["velocity_history"].flatten(1)}

    def score(self, features: Features, candidates: Observation) -> Tensor:
        both = torch.cat((features["history"], candidates["r_img"][:, None]), dim=1)
        found: Tensor = self.net(both)
        return found

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        self.taught.append(observation["r_img"].tolist())
        loss = super().loss(observation, success, mask, weight)
        return replace(loss, parts={"half": loss.total / 2})


def make_model(seed: int = 0, **options: float) -> TinyModel:
    torch.manual_seed(step_seed(seed, -1))
    return TinyModel(**options)  # type: ignore[arg-type]


def columns() -> tuple[Column, ...]:
    shapes: dict[str, tuple[str, tuple[int, ...]]] = {
        "velocity_history": ("float32", (4, 2)),
        "r_img": ("float32", ()),
        "points": ("float32", (5, 3)),
        "point_count": ("int32", ()),
        "laser_scan": ("float32", (6,)),
        "success": ("uint8", (HORIZON,)),
        "success_mask": ("bool", (HORIZON,)),
        "recording": ("int32", ()),
    }
    return tuple(
        Column(name=name, dtype=dtype, shape=shape, unit="", frame="", meaning="", stage="test")
        for name, (dtype, shape) in shapes.items()
    )


def make_rows(rows: int, seed: int, recording: int) -> Arrays:
    """Rows that fail where they turn left; r_img numbers them."""
    draw = np.random.default_rng(seed)
    velocity = draw.normal(size=(rows, 4, 2)).astype(np.float32)
    velocity[:, :, 1] += np.where(np.arange(rows) % 3 == 0, 1.5, -1.5)[:, None]
    steps = np.arange(HORIZON)
    success = (np.arange(rows) % 3 != 0)[:, None] | (steps < 1)
    points = draw.normal(size=(rows, 5, 3)).astype(np.float32)
    points[:, 3:] = np.nan
    return {
        "velocity_history": velocity,
        "r_img": np.arange(rows, dtype=np.float32) / rows,
        "points": points,
        "point_count": np.full(rows, 3, np.int32),
        "laser_scan": np.full((rows, 6), np.inf, np.float32),
        "success": success.astype(np.uint8),
        "success_mask": np.ones((rows, HORIZON), np.bool_),
        "recording": np.full(rows, recording, np.int32),
    }


def make_splits() -> dict[str, Arrays]:
    return {
        split: make_rows(rows, place, place) for place, (split, rows) in enumerate(ROWS.items())
    }


def write_dataset(
    folder: Path,
    splits: dict[str, Arrays],
    declared: tuple[Column, ...] | None = None,
    pieces: int = 1,
) -> Path:
    declared = columns() if declared is None else declared
    names = [column.name for column in declared]
    shards = {}
    for split, arrays in splits.items():
        kept = {name: np.array_split(arrays[name], pieces) for name in names}
        shards[split] = [
            write_shard(
                folder, f"{split}/{k}.npz", declared, {name: kept[name][k] for name in names}
            )
            for k in range(pieces)
        ]
    counts = {split: len(arrays["success"]) for split, arrays in splits.items()}
    index = DatasetIndex(
        name="tiny",
        columns=declared,
        group_key="day",
        splits=shards,
        recordings=[
            RecordingEntry(
                name=f"{split}.bag",
                digest=f"{place:064x}",
                group=split,
                split=split,
                rows=rows,
                columns={
                    name: shard.columns[name] for shard in shards[split] for name in shard.columns
                },
            )
            for place, (split, rows) in enumerate(counts.items())
        ],
    )
    write_index(folder, index)
    return folder


def train_tiny(
    dataset: Path,
    out: Path,
    recipe: Recipe = RECIPE,
    model: SuccessModel | None = None,
    progress: TrainingProgress | None = None,
    machine: Machine = MACHINE,
    begin: Path | None = None,
) -> SuccessModel:
    """Train and give the model back, with its best weights."""
    model = make_model(recipe.seed) if model is None else model
    named = NamedModel(model, "tiny", "small", {})
    train_model(named, TrainingPlan(dataset, recipe, out, begin), progress, machine)
    return model


class _Telling(TinyModel):
    """Says each step, and stays in one until it is killed."""

    hold = 0

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        loss = super().loss(observation, success, mask, weight)
        sys.stdout.write(f"step {len(self.taught)}\n")
        sys.stdout.flush()
        if len(self.taught) == self.hold:
            time.sleep(60)
        return loss


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("dataset", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--hold", type=int, default=0)
    parser.add_argument(
        "--plain", action="store_true", help="without dropout and norm, batches of 2"
    )
    given = parser.parse_args()
    changes = {"batch_size": 2, "balance": "none"} if given.plain else {}
    recipe = RECIPE.model_copy(update=changes)
    torch.manual_seed(step_seed(recipe.seed, -1))
    model = _Telling(dropout=0.0, norm=False) if given.plain else _Telling()
    model.hold = given.hold
    train_tiny(given.dataset, given.out, recipe, model)
    rank = os.environ.get("RANK", "0")
    rows = "\n".join(" ".join(map(str, batch)) for batch in model.taught)
    (given.out / f"taught_{rank}.txt").write_text(rows)
    weights = torch.cat([value.flatten() for value in model.state_dict().values()])
    np.save(given.out / f"weights_{rank}.npy", weights.numpy())


if __name__ == "__main__":
    main()
