"""A model that fears the left is asked about candidates in the scenes of a small dataset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from numpy.typing import NDArray

from graspe_data.bundle_contract import GraphTensor
from graspe_data.progress import Silent
from graspe_data.shards import Dataset
from pipelines.build import build_dataset
from pipelines.candidates import columns_of, most_telling, score_row, write_candidates_picture
from pipelines.dataset_settings import DatasetRecipe
from pipelines.executors import Workers
from tests.pipelines.conftest import RecordingFactory

Arrays = Mapping[str, NDArray[Any]]


@dataclass
class FearsTheLeft:
    """Stands for a bundle: success falls with the share of the picture's left that is covered."""

    contract: Any = field(
        default_factory=lambda: SimpleNamespace(
            model="fearful",
            encode_inputs=(GraphTensor(name="image", dtype="uint8", shape=(1, 60, 80, 3)),),
            features=(GraphTensor(name="light", dtype="float32", shape=(1, 1)),),
            score_inputs=(
                GraphTensor(name="light", dtype="float32", shape=(1, 1)),
                GraphTensor(name="trajectory_image", dtype="uint8", shape=("K", 60, 80)),
                GraphTensor(name="r_img", dtype="float32", shape=(1,)),
            ),
            decision=SimpleNamespace(acceptance=0.5),
        )
    )

    def encode(self, observation: Arrays) -> Arrays:
        assert set(observation) == {"image"}
        return {"light": observation["image"].mean(keepdims=True)[0, :, 0]}

    def score(self, features: Arrays, candidates: Arrays) -> NDArray[np.float32]:
        assert set(features) == {"light"}
        assert set(candidates) == {"trajectory_image", "r_img"}
        left = candidates["trajectory_image"][:, :, :40].mean(axis=(1, 2), dtype=np.float32)
        return np.repeat(1 - left[:, None], 5, axis=1)


@pytest.fixture
def split(tmp_path: Path, record: RecordingFactory, recipe: DatasetRecipe) -> Dataset:
    """The rows of one recording, in whichever split its digest puts them."""
    result = build_dataset(recipe, [record()], tmp_path / "dataset", Workers(), Silent())
    bundle: Any = FearsTheLeft()
    (name,) = [name for name in result.index.splits if result.index.rows(name)]
    return Dataset(tmp_path / "dataset", name, columns_of(bundle))


def test_candidates_lie_over_all_that_the_robot_can_and_are_drawn_where_they_lead(
    split: Dataset,
) -> None:
    bundle: Any = FearsTheLeft()
    scored = score_row(bundle, split, 0)
    limits = scored.scene.recipe.robot.limits
    assert scored.velocities[:, 0].max() == pytest.approx(limits.linear_velocity[1])
    assert np.ptp(scored.velocities[:, 1]) == pytest.approx(np.ptp(limits.yaw_rate))
    fast = scored.velocities[:, 0] == scored.velocities[:, 0].max()
    by_yaw = scored.least[fast][np.argsort(scored.velocities[fast, 1])]
    assert by_yaw[0] > by_yaw[-1]  # the last turns left


def test_the_scene_whose_candidates_differ_most_is_told_of(split: Dataset) -> None:
    bundle: Any = FearsTheLeft()
    scene = most_telling(bundle, split)
    spreads = [score_row(bundle, split, row).least.std() for row in range(len(split))]
    assert scene.least.std() <= max(spreads)
    assert scene.least.std() > 0


def test_the_picture_shows_good_candidates_in_green_and_bad_ones_in_red(
    split: Dataset, tmp_path: Path
) -> None:
    bundle: Any = FearsTheLeft()
    write_candidates_picture(score_row(bundle, split, 0), tmp_path / "candidates.png")
    red, green, blue = np.moveaxis(imread(tmp_path / "candidates.png")[..., :3], -1, 0)
    assert np.count_nonzero((green > red + 0.2) & (green > blue + 0.2)) > 100
