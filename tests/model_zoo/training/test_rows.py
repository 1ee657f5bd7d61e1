from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from model_zoo.augmentation import AugmentationSettings
from model_zoo.contents import check_values
from model_zoo.labels import Labels
from model_zoo.training.preparation import Preparation
from model_zoo.training.rows import ChosenRows, choose_rows
from tests.model_zoo.training.tiny import make_splits, write_dataset


def test_rows_without_a_judged_step_are_not_read(dataset: Path) -> None:
    success, mask = np.ones((24, 3), bool), np.ones((24, 3), bool)
    mask[[3, 7]] = False
    rows = choose_rows(Labels(success, mask), "rows")
    chosen = ChosenRows(Dataset(dataset, "train", ["r_img"]), rows)
    assert len(chosen) == 22
    assert not {3, 7} & set(rows.indices.tolist())
    assert chosen.batch(np.array([3]))["r_img"] == np.float32(4 / 24)


def test_resampled_rows_are_those_of_the_judged_ones() -> None:
    success, mask = np.ones((8, 1), bool), np.ones((8, 1), bool)
    success[[1, 6]], mask[6] = False, False
    rows = choose_rows(Labels(success, mask), "resample")
    assert rows.indices.tolist() == [0, 1, 3, 5, 1]
    assert rows.mirrored.tolist() == [False] * (len(rows) - 1) + [True]


def test_only_marked_rows_are_mirrored_and_the_mark_is_dropped() -> None:
    scan = torch.arange(6.0).reshape(2, 3)
    batch = {"laser_scan": scan, "mirrored": torch.tensor([False, True])}
    prepared = Preparation(None, 0)(batch, 1)
    assert prepared.keys() == {"laser_scan"}
    assert prepared["laser_scan"].tolist() == [[0, 1, 2], [5, 4, 3]]


def test_augmentation_follows_from_seed_and_number() -> None:
    scan = torch.rand(6, 40)
    settings = AugmentationSettings()

    def prepared(seed: int, number: int) -> torch.Tensor:
        return Preparation(settings, seed)({"laser_scan": scan}, number)["laser_scan"]

    assert torch.equal(prepared(1, 7), prepared(1, 7))
    assert not torch.equal(prepared(1, 7), prepared(1, 8))
    assert not torch.equal(prepared(1, 7), prepared(2, 7))


def test_augmentation_reads_what_reliabilities_are_computed_from() -> None:
    offered = ("r_point", "points", "point_count", "smoothness", "image")
    read = Preparation(AugmentationSettings(), 0).columns(("r_point",), offered, "field")
    assert set(read) == {"r_point", "points", "point_count", "smoothness"}
    assert Preparation(None, 0).columns(("r_point",), offered, "field") == ("r_point",)


def test_where_no_lidar_fails_r_point_needs_nothing_else() -> None:
    offered = ("r_point", "points", "point_count")
    with pytest.raises(ZooError, match=r"^field: no column smoothness.*sector_loss, thinning"):
        Preparation(AugmentationSettings(), 0).columns(("r_point",), offered, "field")
    never = {key: {"probability": 0.0} for key in ("sector_loss", "thinning", "scatter")}
    whole = Preparation(AugmentationSettings.model_validate(never), 0)
    assert set(whole.columns(("r_point",), offered, "field")) == set(offered)


def test_padding_and_empty_rays_are_no_fault_but_points_and_nan_are(tmp_path: Path) -> None:
    splits = make_splits()
    columns = ("points", "laser_scan", "velocity_history")
    check_values(Dataset(write_dataset(tmp_path / "sound", splits), "train", columns))
    for name, place in (("points", (2, 1, 0)), ("laser_scan", (2, 4))):
        bad = make_splits()
        bad["train"][name][place] = np.nan
        dataset = Dataset(write_dataset(tmp_path / name, bad), "train", columns)
        with pytest.raises(ZooError, match=f"row 2 .recording train.bag.: column {name} "):
            check_values(dataset)
