"""A dataset that tells how it was made, and checkpoints of models that look at their inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import JsonValue
from torch import nn
from torch.nn.modules.batchnorm import _BatchNorm

from graspe_data.columns import Column
from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.robot import Robot
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, write_index
from graspe_data.shards.shard_writer import write_shard
from model_zoo.checkpoints import TemperatureScaling, TrainedModel, write_checkpoint
from model_zoo.checkpoints.assumptions import read_assumptions
from model_zoo.contract import SuccessModel
from model_zoo.registry import create_model, model_settings

ROWS = 4
SHAPES: dict[str, tuple[str, tuple[int, ...]]] = {
    "image": ("uint8", (240, 320, 3)),
    "points": ("float32", (10_000, 3)),
    "point_count": ("int32", ()),
    "laser_scan": ("float32", (720,)),
    "velocity_history": ("float32", (50, 2)),
    "trajectory_image": ("uint8", (240, 320)),
    "r_img": ("float32", ()),
    "r_point": ("float32", ()),
}
COLUMNS = tuple(
    Column(
        name=name,
        dtype=dtype,
        shape=shape,
        unit="",
        frame="",
        meaning="",
        stage="test",
        codec="packed_bits" if name == "trajectory_image" else "raw",
    )
    for name, (dtype, shape) in SHAPES.items()
)
SIDES = [0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0]
"""The rotation of a camera that looks ahead, row by row."""
DETAILS: dict[str, JsonValue] = {
    "camera": {"width": 320, "height": 240, "fx": 277.0, "fy": 277.0, "cx": 159.5, "cy": 119.5},
    "base_from_camera": [list[JsonValue](SIDES), [0.3, 0.0, 0.1]],
    "base_from_lidar": [[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.3]],
}


@dataclass(frozen=True)
class Made:
    """A model's name, a dataset, a checkpoint that was trained on it, and its bundle."""

    name: str
    dataset: Path
    index: DatasetIndex
    checkpoint: Path
    bundle: Path


def configuration() -> dict[str, Any]:
    """As the pipeline resolves it, with keys that matter to nobody here."""
    robot = load_manifest(find_manifest("robots", "spot"), Robot)
    scan = {"rays": 720, "half_angle": 1.5707963267948966, "maximum_range": 10.0}
    dataset = {
        "name": "made",
        "window": {
            "anchor_rate": 5.0,
            "history_steps": 50,
            "history_step_s": 0.1,
            "points_tolerance_s": 0.1,
            "odometry_gap_s": 0.25,
        },
        "horizon": {"steps": 10, "step_s": 0.3},
        "image": {"width": 320, "height": 240},
        "points": {"neighbours": 5, "sample": {"count": 10_000}, "laser_scan": scan},
        "image_reliability": {"saturation_corners": 800},
        "point_reliability": {"edge_weight": 0.25},
    }
    return {"dataset": dataset, "robot": robot.model_dump(mode="json")}


def made_index(*details: Mapping[str, JsonValue], **changes: Any) -> DatasetIndex:
    recordings = [
        RecordingEntry(name=f"{k}.bag", digest=f"{k:064x}", group="", details=told)
        for k, told in enumerate(details)
    ]
    content: dict[str, Any] = {
        "name": "made",
        "columns": COLUMNS,
        "group_key": "day",
        "splits": {},
        "recordings": recordings,
        "configuration": configuration(),
    }
    return DatasetIndex(**(content | changes))


def rows(count: int) -> dict[str, NDArray[np.generic]]:
    """Observations as unlike each other as can be: each has its own brightness, size and speed."""
    draw = np.random.default_rng(3)
    size = np.linspace(0.1, 1.0, count)

    def sized(*shape: int) -> NDArray[np.float64]:
        return size.reshape(count, *(1 for _ in shape)) * draw.random((count, *shape))

    points = (12 * sized(10_000, 3) - 6 * size[:, None, None]).astype(np.float32)
    points[:, 7000:] = np.nan
    drawn = np.abs(np.arange(320) - 320 * size[:, None]) < 60
    return {
        "image": (255 * sized(240, 320, 3)).astype(np.uint8),
        "points": points,
        "point_count": np.full(count, 7000, np.int32),
        "laser_scan": (10 * sized(720)).astype(np.float32),
        "velocity_history": sized(50, 2).astype(np.float32),
        "trajectory_image": np.repeat(drawn[:, None], 240, axis=1).astype(np.uint8),
        "r_img": size.astype(np.float32),
        "r_point": size[::-1].astype(np.float32),
    }


def write_dataset(folder: Path, **changes: Any) -> DatasetIndex:
    arrays = rows(ROWS)
    arrays["trajectory_image"] = np.packbits(arrays["trajectory_image"] != 0, axis=-1)
    shard = write_shard(folder, "shards/test.npz", COLUMNS, arrays)
    entry = RecordingEntry(
        name="a.bag", digest="a" * 64, group="", split="test", rows=ROWS, details=DETAILS
    )
    content: dict[str, Any] = {"splits": {"test": [shard]}, "recordings": [entry]}
    index = made_index(**(content | changes))
    return write_index(folder, index)


def last_layer(model: SuccessModel) -> nn.Linear:
    """The layer that gives the log-odds; models may have dense layers beside it."""
    family = getattr(model, "graph", None)
    within = model.modules() if family is None else family.modules()
    return [module for module in within if isinstance(module, nn.Linear)][-1]


def lively_model(name: str) -> SuccessModel:
    """Random weights as after some training: log-odds spread by 1 over unlike observations."""
    torch.manual_seed(0)
    model = create_model(name, "small").eval()
    with torch.no_grad():
        for module in model.modules():
            if isinstance(module, _BatchNorm):
                assert module.running_mean is not None
                assert module.running_var is not None
                module.running_mean.normal_(0, 0.1)
                module.running_var.uniform_(0.3, 1.5)
                if module.affine:
                    module.weight.uniform_(0.7, 1.5)
        last = last_layer(model)
        seen = model.logits({name: torch.from_numpy(column) for name, column in rows(8).items()})
        spread, sign = seen.std(dim=0).mean(), -1 if name == "paad" else 1
        last.weight.div_(spread)
        last.bias.copy_((last.bias - sign * seen.mean(dim=0)) / spread)
    return model


def write_made(
    folder: Path, name: str, index: DatasetIndex, *, told: bool = True, **changes: Any
) -> Path:
    """A checkpoint of a lively model; without ``told`` it does not know how its data were made."""
    arguments: dict[str, Any] = {
        "model_name": name,
        "preset": "small",
        "numbers": model_settings(name, "small").model_dump(mode="json"),
        "model": lively_model(name),
        "columns": index.columns,
        "recipe": {},
        "dataset_digest": index.dataset_digest,
        "metrics": {},
        "calibration": TemperatureScaling(
            temperature=1.7, judged=9, loss_before=0.9, loss_after=0.8
        ),
        "assumptions": read_assumptions(index) if told else None,
    }
    return write_checkpoint(folder, TrainedModel(**(arguments | changes)))
