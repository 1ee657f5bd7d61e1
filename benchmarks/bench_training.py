"""Train a few steps: samples a second against batches in memory, and the share spent waiting."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from benchmarks.measurement import Measurement, render_table
from graspe_data.columns import Column
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, write_index
from graspe_data.shards.shard_writer import write_shard
from model_zoo.augmentation import AugmentationSettings
from model_zoo.batches import Batch
from model_zoo.labels import LABEL_COLUMNS
from model_zoo.registry import create_model
from model_zoo.training.machine import Machine, launch_fabric
from model_zoo.training.meter import Stopwatch
from model_zoo.training.optimisation import Optimisation
from model_zoo.training.progress import SilentProgress
from model_zoo.training.recipe import Recipe
from model_zoo.training.rows import RowWeights
from model_zoo.training.state import EpochRecord
from model_zoo.training.train import train

MODEL, PRESET = "graspe", "small"
ROWS, QUICK_ROWS, VALIDATION_ROWS = 512, 96, 16
EPOCHS = 2
RECIPE = Recipe(epochs=EPOCHS, batch_size=16, patience=None)
WITHOUT_LABELS = {
    "image": ("uint8", (240, 320, 3)),
    "points": ("float32", (10000, 3)),
    "smoothness": ("float32", (10000,)),
    "point_count": ("int32", ()),
    "laser_scan": ("float32", (720,)),
    "velocity_history": ("float32", (50, 2)),
    "trajectory_image": ("uint8", (240, 320)),
    "r_img": ("float32", ()),
    "r_point": ("float32", ()),
}
SHAPES: dict[str, tuple[str, tuple[int, ...]]] = {
    **WITHOUT_LABELS,
    "success": ("uint8", (10,)),
    "success_mask": ("bool", (10,)),
}


class Records(SilentProgress):
    """Keeps the epochs."""

    def __init__(self) -> None:
        self.epochs: list[EpochRecord] = []

    def epoch(self, record: EpochRecord, best: bool) -> None:  # noqa: ARG002
        self.epochs.append(record)


def make_rows(rows: int, seed: int) -> dict[str, NDArray[np.generic]]:
    draw = np.random.default_rng(seed)
    arrays: dict[str, NDArray[np.generic]] = {
        name: draw.integers(0, 256 if name == "image" else 2, (rows, *shape)).astype(dtype)
        if dtype == "uint8"
        else draw.random((rows, *shape), np.float32)
        for name, (dtype, shape) in SHAPES.items()
        if name not in {"point_count", "success_mask"}
    }
    arrays["point_count"] = np.full(rows, 9000, np.int32)
    arrays["success_mask"] = np.ones((rows, 10), np.bool_)
    return arrays


def write_dataset(folder: Path, rows: int) -> Path:
    """Random rows of a full size, every split in one shard."""
    columns = tuple(
        Column(name=name, dtype=dtype, shape=shape, unit="", frame="", meaning="", stage="bench")
        for name, (dtype, shape) in SHAPES.items()
    )
    counts = {"train": rows, "validation": VALIDATION_ROWS}
    shards = {
        split: [write_shard(folder, f"{split}/0.npz", columns, make_rows(count, place))]
        for place, (split, count) in enumerate(counts.items())
    }
    recordings = [
        RecordingEntry(name=split, digest=f"{place:064x}", group=split, split=split, rows=count)
        for place, (split, count) in enumerate(counts.items())
    ]
    index = DatasetIndex(
        name="bench", columns=columns, group_key="none", splits=shards, recordings=recordings
    )
    write_index(folder, index)
    return folder


def rate_from_memory(dataset: Path, rows: int, out: Path) -> float:
    """Samples a second of the same steps on one batch that is already there."""
    model = create_model(MODEL, PRESET)
    fabric = launch_fabric(Machine(tensorboard=False), RECIPE, out)
    optimisation = Optimisation(fabric, model, RECIPE, RowWeights())
    reader = Dataset(dataset, "train", (*model.columns, *LABEL_COLUMNS))
    arrays = reader.batch(np.arange(RECIPE.batch_size))
    batch: Batch = {name: torch.from_numpy(array) for name, array in arrays.items()}
    steps = rows // RECIPE.batch_size
    optimisation.step(batch, 0, steps)
    watch = Stopwatch()
    for step in range(steps):
        float(optimisation.step(batch, step, steps)["loss"])
    return steps * RECIPE.batch_size / watch.seconds


def measure(dataset: Path, out: Path, recipe: Recipe) -> EpochRecord:
    """The last epoch of a short training: by then pages and readers are warm."""
    records = Records()
    train(MODEL, PRESET, dataset, recipe, out, records, Machine(tensorboard=False))
    return records.epochs[-1]


def compare(folder: Path, rows: int) -> Iterator[Measurement]:
    dataset = write_dataset(folder / "dataset", rows)
    floor = rate_from_memory(dataset, rows, folder)
    device = torch.cuda.get_device_name() if torch.cuda.is_available() else "CPU"
    note = f"{MODEL} {PRESET}, {rows} rows of full size, batch {RECIPE.batch_size}, {device}"
    augmented = RECIPE.model_copy(update={"augmentation": AugmentationSettings()})
    for name, recipe in (("train", RECIPE), ("train, augmented", augmented)):
        record = measure(dataset, folder / name, recipe)
        rate, share = record.samples_per_s, record.data_wait_share
        yield Measurement(name, rate, "samples/s", "one batch in memory", floor, None, note=note)
        yield Measurement(
            f"{name}: waiting for data", share, "of time", target=0.05, better="lower", note=note
        )


def run(quick: bool) -> list[Measurement]:
    """Measure; ``quick`` takes fewer rows."""
    with tempfile.TemporaryDirectory() as folder:
        return list(compare(Path(folder), QUICK_ROWS if quick else ROWS))


if __name__ == "__main__":
    print(render_table(run(quick="--quick" in sys.argv)))
