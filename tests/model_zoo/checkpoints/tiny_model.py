"""A model of a dozen weights, and a dataset that it can read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from graspe_data.columns import Column
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, write_index
from graspe_data.shards.shard_writer import write_shard
from model_zoo.contract import Features, Observation, SuccessModel

HORIZON, BEAMS = 3, 40
_COMMON = {"unit": "", "frame": "", "meaning": "", "stage": "test"}
INPUTS = (
    Column(name="velocity_history", dtype="float32", shape=(4, 2), **_COMMON),
    Column(name="r_img", dtype="float32", shape=(), **_COMMON),
)
COLUMNS = (
    *INPUTS,
    Column(name="image", dtype="uint8", shape=(6, 8, 3), **_COMMON),
    Column(name="success", dtype="uint8", shape=(HORIZON,), **_COMMON),
    Column(name="success_mask", dtype="bool", shape=(HORIZON,), **_COMMON),
    Column(name="recording", dtype="int32", shape=(), **_COMMON),
    Column(name="stamp_ns", dtype="int64", shape=(), **_COMMON),
    Column(name="state", dtype="uint8", shape=(), **_COMMON),
)
WITH_CANDIDATES = (
    *COLUMNS,
    Column(name="trajectory_image", dtype="uint8", shape=(6, 8), **_COMMON),
    Column(name="candidate_velocity", dtype="float32", shape=(4, 2), **_COMMON),
    Column(name="candidate_image", dtype="uint8", shape=(4, 6, 8), **_COMMON),
    Column(name="candidate_success", dtype="uint8", shape=(4, HORIZON), **_COMMON),
    Column(name="candidate_mask", dtype="bool", shape=(4,), **_COMMON),
)
"""Of each row four candidates. What covers most of the picture fails, and the fast cover most."""
BEFORE = ("train", "train", "validation", "validation", "validation")
"""Splits of the recordings that come after those of ``test``."""


class TinyModel(SuccessModel):
    """A linear layer."""

    columns: ClassVar[tuple[str, ...]] = ("velocity_history", "r_img")
    candidate_columns: ClassVar[tuple[str, ...]] = ("r_img",)

    def __init__(self, horizon: int = HORIZON) -> None:
        super().__init__()
        self.horizon = horizon
        self.linear = nn.Linear(9, horizon)
        self.register_buffer("calls", torch.zeros((), dtype=torch.int64))

    def encode(self, scene: Observation) -> Features:
        assert set(scene) == set(self.columns)
        return {"history": scene["velocity_history"].flatten(1)}

    def score(self, features: Features, candidates: Observation) -> Tensor:
        both = torch.cat([features["history"], candidates["r_img"][:, None]], dim=1)
        out: Tensor = self.linear(both)
        return out


class DrawnModel(TinyModel):
    """Says that what covers more of the picture fails."""

    columns = ("velocity_history", "r_img", "trajectory_image")
    candidate_columns = ("r_img", "trajectory_image")

    def score(self, features: Features, candidates: Observation) -> Tensor:
        covered = candidates["trajectory_image"].float().mean(dim=(1, 2))
        return super().score(features, candidates) - 50 * covered[:, None]


def write_tiny_dataset(
    folder: Path,
    groups: Sequence[str],
    rows: int = 12,
    *,
    columns: Sequence[Column] = COLUMNS,
    judged: float = 0.9,
    **replaced: object,
) -> Path:
    """A split ``test`` with one recording of so many rows for each group; labels follow r_img.

    Every fourth row whose first step fails is failing at its anchor. Behind ``test`` stand some
    recordings to teach and choose the blind references on.
    """
    random = np.random.default_rng(0)
    tested = _rows(random, rows * len(groups), judged)
    for name, value in replaced.items():
        tested[name] = np.full_like(tested[name], value)
    splits = {"test": tested}
    splits |= {
        split: _rows(random, rows * BEFORE.count(split), 0.9) for split in ("train", "validation")
    }
    _commit(folder, groups, rows, columns, splits, replaced)
    return folder


Arrays = dict[str, NDArray[np.generic]]


def _rows(random: np.random.Generator, count: int, judged: float) -> Arrays:
    r_img = random.random(count, dtype=np.float32)
    chance = np.sort(random.random((count, HORIZON)), axis=1)
    success = (chance < r_img[:, None]).astype(np.uint8)
    failing = (success[:, 0] == 0) & (np.arange(count) % 4 == 0)
    found: Arrays = {
        "velocity_history": random.normal(size=(count, 4, 2)).astype(np.float32),
        "r_img": r_img,
        "image": random.integers(0, 256, (count, 6, 8, 3), dtype=np.uint8),
        "laser_scan": random.uniform(1, 9, (count, BEAMS)).astype(np.float32),
        "success": success,
        "success_mask": random.random((count, HORIZON)) < judged,
        "recording": np.zeros(count, np.int32),
        "stamp_ns": np.arange(count)[::-1].astype(np.int64),
        "state": np.where(failing, 0, 3).astype(np.uint8),
    }
    return found | _candidates(random, count)


def _candidates(random: np.random.Generator, count: int) -> Arrays:
    speed = random.random((count, 4))
    covered = np.arange(48).reshape(6, 8) < 48 * speed[..., None, None]
    through = np.repeat(speed[..., None] + random.normal(0, 0.2, (count, 4, 1)) < 0.5, HORIZON, 2)
    return {
        "trajectory_image": covered[:, 0].astype(np.uint8),
        "candidate_velocity": np.stack([speed, 0 * speed], axis=2).astype(np.float32),
        "candidate_image": covered.astype(np.uint8),
        "candidate_success": through.astype(np.uint8),
        "candidate_mask": random.random((count, 4)) < 0.9,
    }


def _commit(
    folder: Path,
    groups: Sequence[str],
    rows: int,
    columns: Sequence[Column],
    splits: dict[str, Arrays],
    replaced: dict[str, object],
) -> None:
    entries = [
        RecordingEntry(name=f"{k}.bag", digest=f"{k:064x}", group=group, split=split, rows=rows)
        for k, (group, split) in enumerate(
            [*((group, "test") for group in groups), *(("", split) for split in BEFORE)]
        )
    ]
    shards = {}
    for split, arrays in splits.items():
        places = [k for k, entry in enumerate(entries) if entry.split == split]
        if split != "test" or "recording" not in replaced:
            arrays["recording"] = np.repeat(np.array(places, np.int32), rows)
        kept = {column.name: arrays[column.name] for column in columns}
        shards[split] = [write_shard(folder, f"{split}/0.npz", columns, kept)]
    index = DatasetIndex(
        name="tiny",
        columns=tuple(columns),
        group_key="place",
        splits=shards,
        recordings=entries,
    )
    write_index(folder, index)
