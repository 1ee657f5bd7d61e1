"""Reliabilities that are measured, another row's, or those of who knows which sensor fails."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from graspe_data.errors import ZooError
from model_zoo.augmentation import (
    FAILING_SENSOR,
    KNOWN_CONDITIONS,
    AugmentationSettings,
    Condition,
    apply_condition,
    augment,
)
from model_zoo.augmentation.failing_rows import RowFailure
from model_zoo.augmentation.lidar_failure import LidarFailure
from model_zoo.augmentation.picture_failure import PictureFailure
from model_zoo.augmentation.reliability import give_reliabilities, taught_with

ROWS = 12
SOUND = RowFailure((0, 0, 0))
BLIND = RowFailure((0, 0, 0), PictureFailure(covered=1.0))
DEAF = RowFailure((0, 0, 0), lidar=LidarFailure(0.0, 1.0))


@pytest.fixture
def batch() -> dict[str, Tensor]:
    generator = torch.Generator().manual_seed(3)
    pictures = torch.randint(0, 256, (ROWS, 24, 32, 3), generator=generator).to(torch.uint8)
    r_img, r_point = torch.rand(2, ROWS, generator=generator)
    return {"image": pictures, "r_img": r_img, "r_point": r_point}


def test_measured_reliabilities_stay(batch: dict[str, Tensor]) -> None:
    assert give_reliabilities(batch, "measured", [SOUND] * ROWS, [0]) is batch


def test_shuffled_ones_are_those_of_other_rows(batch: dict[str, Tensor]) -> None:
    given = give_reliabilities(batch, "shuffled", [SOUND] * ROWS, [1])
    again = give_reliabilities(batch, "shuffled", [SOUND] * ROWS, [1])
    for name in ("r_img", "r_point"):
        assert not torch.equal(given[name], batch[name])
        assert torch.equal(given[name].sort().values, batch[name].sort().values)
        assert torch.equal(given[name], again[name])
    # Both sensors' come from the same row: only what they say of this one is lost.
    pairs = {*zip(batch["r_img"].tolist(), batch["r_point"].tolist(), strict=True)}
    assert {*zip(given["r_img"].tolist(), given["r_point"].tolist(), strict=True)} == pairs
    assert given["image"] is batch["image"]


def test_known_ones_tell_which_sensor_was_made_to_fail(batch: dict[str, Tensor]) -> None:
    failures = [SOUND, BLIND, DEAF, *[SOUND] * (ROWS - 3)]
    given = give_reliabilities(batch, "known", failures, [0])
    assert given["r_img"].tolist() == [1, 0, *[1] * (ROWS - 2)]
    assert given["r_point"].tolist() == [1, 1, 0, *[1] * (ROWS - 3)]
    assert given["r_img"].dtype == batch["r_img"].dtype


@pytest.mark.parametrize("condition", KNOWN_CONDITIONS)
def test_the_sensor_that_a_condition_fails_has_a_known_reliability_of_0(
    condition: Condition, batch: dict[str, Tensor]
) -> None:
    settings = AugmentationSettings(reliability="known")
    given = apply_condition(batch, condition, 0, settings)
    failing = FAILING_SENSOR.get(condition)
    assert given["r_point"].tolist() == [float(failing != "lidar")] * ROWS
    assert given["r_img"].tolist() == [float(failing != "camera")] * ROWS


def test_in_training_known_reliabilities_follow_what_was_drawn(batch: dict[str, Tensor]) -> None:
    never = {"probability": 0.0}
    whole = {"probability": 0.5, "share": (1.0, 1.0), "wholly": 1.0}
    settings = AugmentationSettings.model_validate(
        {"reliability": "known", "darkness": never, "blur": never, "cover": whole}
    )
    given = augment(batch, settings, 0, 7)
    black = np.array([int(picture.max()) < 128 for picture in given["image"]])
    assert 0 < black.sum() < ROWS
    np.testing.assert_array_equal(given["r_img"].numpy(), 1.0 - black)


def test_a_recipe_tells_what_its_model_was_taught_with() -> None:
    assert taught_with({}) == taught_with({"augmentation": None}) == "measured"
    assert taught_with({"augmentation": {"reliability": "shuffled"}}) == "shuffled"
    with pytest.raises(ZooError, match="'guessed', expected one of measured, shuffled, known"):
        taught_with({"augmentation": {"reliability": "guessed"}})
