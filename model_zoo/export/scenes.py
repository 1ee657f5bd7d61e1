"""What a bundle is tried on: scenes of real rows or drawn ones, adverse ones, and candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray

from graspe_data.bundle_contract import BundleContract, GraphTensor
from graspe_data.errors import ZooError
from graspe_data.observation.trajectory import PredictedTrajectory
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index
from model_zoo.contract import Observation

Kind = Literal["real", "drawn", "adverse"]
Columns = Mapping[str, NDArray[np.generic]]

SPLITS = ("test", "validation", "train")
SCENES = 3
_FARTHEST = 10.0


@dataclass(frozen=True)
class SceneRow:
    """One row's columns, each with a leading axis of 1."""

    name: str
    kind: Kind
    columns: Columns

    def observation(self) -> Observation:
        """The columns as tensors."""
        return {name: torch.from_numpy(np.asarray(c)) for name, c in self.columns.items()}


def real_scenes(dataset: Path, columns: tuple[str, ...]) -> list[SceneRow]:
    """Rows spread over the first of the splits test, validation, train that has any.

    Args:
        dataset: The dataset's folder.
        columns: Those that the model reads.

    Raises:
        ZooError: None of these splits has a row.
        ShardError: The dataset is none, or damaged.
    """
    index = read_index(dataset)
    split = next((name for name in SPLITS if name in index.splits and index.rows(name)), None)
    if split is None:
        raise ZooError(f"{dataset}: no row in {', '.join(SPLITS)} to try the bundle on.")
    rows = Dataset(dataset, split, columns, check="sha256")
    places = np.unique(np.linspace(0, len(rows) - 1, SCENES).astype(np.int64)).tolist()
    return [
        SceneRow(f"{split}_{place}", "real", {k: v[None] for k, v in rows.row(place).items()})
        for place in places
    ]


def drawn_scenes(inputs: Sequence[GraphTensor]) -> list[SceneRow]:
    """Scenes of noise within what sensors give, for want of real ones; always the same.

    Args:
        inputs: Of the model; a candidate is one that is not in the picture.
    """
    draw = np.random.default_rng(0)
    return [SceneRow(f"drawn_{k}", "drawn", _noise(inputs, draw)) for k in range(SCENES)]


def adverse_scenes(scene: SceneRow) -> list[SceneRow]:
    """A scene with what fails on robots; those that change nothing of the model's are left out."""
    columns = scene.columns
    changes: dict[str, dict[str, float]] = {
        "black_image": {"image": 0, "r_img": 0},
        "white_image": {"image": 255},
        "empty_cloud": {"points": np.nan, "point_count": 0, "laser_scan": np.inf, "r_point": 0},
        "one_point": {"point_count": 1},
        "no_reliability": {"r_img": 0, "r_point": 0},
        "standing": {"velocity_history": 0},
    }
    return [
        SceneRow(name, "adverse", {**columns, **_filled(columns, change)})
        for name, change in changes.items()
        if change.keys() & columns.keys()
    ]


def _filled(columns: Columns, change: Mapping[str, float]) -> Columns:
    return {
        name: np.full_like(columns[name], value)
        for name, value in change.items()
        if name in columns
    }


def _noise(inputs: Sequence[GraphTensor], draw: np.random.Generator) -> Columns:
    sizes = {
        tensor.name: tuple(1 if size == "K" else size for size in tensor.shape) for tensor in inputs
    }
    count = sizes.get("points", (1, 1))[1] * 3 // 4
    columns: dict[str, NDArray[np.generic]] = {}
    for name, size in sizes.items():
        match name:
            case "image":
                columns[name] = draw.integers(0, 256, size, np.uint8)
            case "points":
                points = draw.uniform((0, -8, -0.5), (15, 8, 2), size).astype(np.float32)
                points[:, count:] = np.nan
                columns[name] = points
            case "point_count":
                columns[name] = np.full(size, count, np.int32)
            case "laser_scan":
                ranges = draw.uniform(0.5, 12.0, size).astype(np.float32)
                columns[name] = np.where(ranges < _FARTHEST, ranges, np.float32(np.inf))
            case "velocity_history":
                columns[name] = draw.uniform(-0.6, 0.6, size).astype(np.float32)
            case "trajectory_image":
                columns[name] = np.zeros(size, np.uint8)
            case _:
                columns[name] = draw.random(size, np.float32)
    return columns


SIDE = 10
_STRIDE = 37


def candidate_images(contract: BundleContract) -> NDArray[np.uint8]:
    """Draw 100 candidates, from the robot's slowest to its fastest, left to right, well mixed.

    Args:
        contract: Of the bundle; where it does not know the camera, oblique bands stand for arcs.

    Returns:
        uint8 (100, H, W): 1 on the trajectory.
    """
    limits = contract.robot.limits
    lattice = np.stack(
        np.meshgrid(
            np.linspace(*limits.linear_velocity, SIDE), np.linspace(*limits.yaw_rate, SIDE)
        ),
        axis=-1,
    ).reshape(-1, 2)
    # The stride has no factor in common with their number, so each comes once.
    mixed = lattice[np.arange(len(lattice)) * _STRIDE % len(lattice)]
    height, width = contract.observation.picture_size
    camera, pose = contract.robot.camera, contract.robot.base_from_camera
    if camera is None or pose is None:
        return np.stack([_band(height, width, v, omega) for v, omega in mixed.tolist()])
    drawing = PredictedTrajectory(
        intrinsics=camera,
        base_from_camera=pose.transform(),
        base_height=contract.robot.base_height,
        line_width=contract.robot.footprint.width,
        steps=contract.observation.horizon_steps,
        step_s=contract.observation.horizon_step_s,
        behind=contract.observation.drawn_from_behind,
    )
    return np.stack([drawing.draw(v, omega).view(np.uint8) for v, omega in mixed.tolist()])


def _band(height: int, width: int, v: float, omega: float) -> NDArray[np.uint8]:
    """A band from the middle of the lower edge, as long as v and as oblique as the yaw rate."""
    rows, columns = np.ogrid[:height, :width]
    up = height - 1 - rows
    aside = np.abs(columns - width / 2 + up * omega) < width / 16
    return np.asarray(aside & (up < height * min(1.0, abs(v)) / 2), np.uint8)
