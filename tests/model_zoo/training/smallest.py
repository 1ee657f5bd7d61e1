"""Every model at its smallest, and rows that all of them can read; as a script, a training of all.

The script is what ``torchrun`` starts, once a rank.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from graspe_data.columns import Column
from model_zoo.registry import MODELS
from model_zoo.training.recipe import Recipe
from model_zoo.training.train import train
from tests.model_zoo.training.tiny import MACHINE, Arrays, write_dataset

HORIZON, POINTS, BEAMS = 3, 40, 24
ROWS = {"train": 20, "validation": 14}
RECIPE = Recipe(epochs=2, batch_size=3, learning_rate=0.01, patience=None)
SHAPES: dict[str, tuple[str, tuple[int, ...]]] = {
    "image": ("uint8", (240, 320, 3)),
    "points": ("float32", (POINTS, 3)),
    "point_count": ("int32", ()),
    "laser_scan": ("float32", (BEAMS,)),
    "velocity_history": ("float32", (50, 2)),
    "trajectory_image": ("uint8", (240, 320)),
    "r_img": ("float32", ()),
    "r_point": ("float32", ()),
    "success": ("uint8", (HORIZON,)),
    "success_mask": ("bool", (HORIZON,)),
    "recording": ("int32", ()),
}
COLUMNS = tuple(
    Column(name=name, dtype=dtype, shape=shape, unit="", frame="", meaning="", stage="test")
    for name, (dtype, shape) in SHAPES.items()
)
_GRASPE = {
    "horizon": HORIZON,
    "encoders": {
        "image_width": 2,
        "point_number": 8,
        "points": {"channels": [2, 2, 4], "hidden": [4, 4]},
        "trajectory": {"channels": [2, 2]},
    },
}
_GRAPH = {"graph": {"channels": 2, "heads": 2, "head_channels": 2, "hidden": 4}}
_NMFNET = {
    "horizon": HORIZON,
    "width": 2,
    "point_number": 8,
    "point_net": {"channels": [2, 2, 4], "hidden": [4, 4]},
    "fusion": [4, 4],
    "beams": BEAMS,
    "map_pixels": 40,
}
_PAAD = {
    "horizon": HORIZON,
    "trunk_width": 2,
    "beams": BEAMS,
    "hidden": 4,
    "features": 4,
    "heads": 2,
}
SMALLEST: dict[str, dict[str, Any]] = {
    "graspe": _GRASPE | _GRAPH,
    "graspe_gated": _GRASPE | _GRAPH,
    "graspe_no_reliability": _GRASPE | _GRAPH,
    "graspe_plain_reliability": _GRASPE | _GRAPH,
    "graspe_self_aware": _GRASPE | _GRAPH | {"judge_hidden": 4},
    "graspe_no_agnn": _GRASPE | {"convolutions": {"channels": 2, "hidden": 4}},
    "nmfnet": _NMFNET,
    "nmfnet_trajectory": _NMFNET | {"path_features": 4},
    "paad": _PAAD,
}
"""Settings that differ from those of the preset ``small``; a model without is small by itself."""
for _name, _model in MODELS.items():
    _sizes = {"horizon": HORIZON, "beams": BEAMS}
    _fields = _model.settings_type.model_fields
    SMALLEST.setdefault(_name, {key: _sizes[key] for key in _sizes if key in _fields})


def make_rows(rows: int, seed: int, recording: int) -> Arrays:
    """Rows that fail where they are dark and near; no two are alike."""
    draw = np.random.default_rng(seed)
    fails = np.arange(rows) % 3 == 0
    size = np.where(fails, 0.3, 1.0) * draw.uniform(0.5, 1.0, rows)
    success = ~fails[:, None] | (np.arange(HORIZON) < 1)

    def sized(*shape: int) -> Any:
        return size.reshape(rows, *(1 for _ in shape)) * draw.random((rows, *shape))

    left = (320 * size)[:, None]
    drawn = np.abs(np.arange(320) - left) < 40
    return {
        "image": (255 * sized(240, 320, 3)).astype(np.uint8),
        "points": (4 * sized(POINTS, 3)).astype(np.float32),
        "point_count": draw.integers(5, POINTS, rows).astype(np.int32),
        "laser_scan": (5 * sized(BEAMS)).astype(np.float32),
        "velocity_history": sized(50, 2).astype(np.float32),
        "trajectory_image": np.repeat(drawn[:, None], 240, axis=1).astype(np.uint8),
        "r_img": size.astype(np.float32),
        "r_point": size[::-1].astype(np.float32),
        "success": success.astype(np.uint8),
        "success_mask": np.ones((rows, HORIZON), np.bool_),
        "recording": np.full(rows, recording, np.int32),
    }


def write_rows(folder: Path) -> Path:
    splits = {
        split: make_rows(rows, place, place) for place, (split, rows) in enumerate(ROWS.items())
    }
    return write_dataset(folder, splits, COLUMNS)


def train_smallest(name: str, dataset: Path, out: Path, recipe: Recipe = RECIPE) -> Path:
    return train(name, "small", dataset, recipe, out, None, MACHINE, **SMALLEST[name])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("dataset", type=Path)
    parser.add_argument("out", type=Path)
    given = parser.parse_args()
    for name in MODELS:
        train_smallest(name, given.dataset, given.out / name)


if __name__ == "__main__":
    main()
