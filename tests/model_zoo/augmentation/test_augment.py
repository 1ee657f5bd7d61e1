from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from torch import Tensor

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import validate
from graspe_data.observation.image_reliability import ImageReliabilitySettings, image_reliability
from graspe_data.observation.point_reliability import PointReliabilitySettings, point_reliability
from model_zoo.augmentation import (
    AugmentationSettings,
    augment,
    check_lidar_may_fail,
    columns_needed,
)

Make = Callable[..., dict[str, Tensor]]

PARTS = ("darkness", "blur", "cover", "sector_loss", "thinning", "scatter", "late_history")
PICTURE = {"image", "r_bright", "r_corners", "r_img"}
CLOUD = {"points", "intensity", "smoothness", "point_count", "r_edge", "r_planar", "r_point"}


def with_probabilities(mirrored: float, **failing: float) -> AugmentationSettings:
    parts: dict[str, Any] = {part: {"probability": failing.get(part, 0.0)} for part in PARTS}
    return AugmentationSettings(mirror=mirrored, **parts)


def everything() -> AugmentationSettings:
    return with_probabilities(0.5, **dict.fromkeys(PARTS, 0.6))


def same(one: Tensor, other: Tensor) -> bool:
    return torch.equal(one.nan_to_num(-9), other.nan_to_num(-9))


def changed(before: dict[str, Tensor], after: dict[str, Tensor]) -> set[str]:
    return {name for name in before if not same(before[name], after[name])}


def test_zero_probabilities_switch_everything_off(make_batch: Make) -> None:
    batch = make_batch()
    found = augment(batch, with_probabilities(0.0), 3, 4)
    assert all(found[name] is batch[name] for name in batch)


def test_the_batch_given_is_not_changed(make_batch: Make) -> None:
    batch = make_batch(8)
    found = augment(batch, everything(), 0, 0)
    assert changed(batch, make_batch(8)) == set()
    assert found.keys() == batch.keys()
    for name in batch:
        assert (found[name].dtype, found[name].shape) == (batch[name].dtype, batch[name].shape)


@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**63), step=st.integers(0, 2**40))
def test_it_is_a_function_of_seed_and_step(make_batch: Make, seed: int, step: int) -> None:
    batch = make_batch()
    np.random.default_rng().random()
    first, again = (augment(batch, everything(), seed, step) for _ in range(2))
    assert changed(first, again) == set()
    assert changed(first, augment(batch, everything(), seed, step + 1))
    assert changed(first, augment(batch, everything(), seed + 1, step))


def test_a_column_is_changed_alike_whatever_others_there_are(make_batch: Make) -> None:
    batch = make_batch(8)
    whole = augment(batch, everything(), 1, 2)
    for names in (("laser_scan", "image"), ("points", "point_count"), ("velocity_history",)):
        part = augment({name: batch[name] for name in names}, everything(), 1, 2)
        assert part.keys() == set(names)
        assert all(same(part[name], whole[name]) for name in names)


@pytest.mark.parametrize(
    ("part", "columns"),
    [
        ("darkness", PICTURE),
        ("blur", PICTURE),
        ("cover", PICTURE),
        ("sector_loss", {*CLOUD, "laser_scan"}),
        ("thinning", {*CLOUD, "laser_scan"}),
        ("scatter", {*CLOUD, "laser_scan"} - {"intensity", "point_count"}),
    ],
)
def test_a_failure_changes_the_columns_of_its_sensor(
    make_batch: Make, part: str, columns: set[str]
) -> None:
    batch = make_batch(8)
    assert changed(batch, augment(batch, with_probabilities(0, **{part: 1}), 0, 0)) == columns


def test_reliabilities_are_those_of_the_pictures_and_points_that_come_out(
    make_batch: Make,
) -> None:
    batch = make_batch(8)
    found = augment(batch, with_probabilities(0, **dict.fromkeys(PARTS, 0.6)), 5, 6)
    for row in range(8):
        picture = image_reliability(found["image"][row].numpy(), ImageReliabilitySettings())
        count = int(found["point_count"][row])
        cloud = point_reliability(
            found["smoothness"][row, :count].numpy(), PointReliabilitySettings()
        )
        for name, value in {**vars(picture), **vars(cloud)}.items():
            assert float(found[name][row]) == float(np.float32(value))


def test_points_that_are_left_stand_in_order_before_the_padding(make_batch: Make) -> None:
    batch = make_batch(8)
    found = augment(batch, with_probabilities(0, sector_loss=1, thinning=0.5), 0, 0)
    assert int(found["point_count"].sum()) < 0.9 * int(batch["point_count"].sum())
    for row in range(8):
        count = int(found["point_count"][row])
        for name in ("points", "intensity", "smoothness"):
            assert found[name][row, :count].isfinite().all()
            assert found[name][row, count:].isnan().all()
        left = torch.isin(batch["intensity"][row], found["intensity"][row, :count])
        assert torch.equal(batch["points"][row][left], found["points"][row, :count])


def test_all_returns_lost_leave_no_reliability(make_batch: Make) -> None:
    blind = AugmentationSettings.model_validate(
        {**with_probabilities(0).model_dump(), "sector_loss": {"probability": 1, "wholly": 1}}
    )
    found = augment(make_batch(), blind, 0, 0)
    assert found["point_count"].tolist() == [0, 0, 0]
    assert found["r_point"].tolist() == [0, 0, 0]
    assert found["points"].isnan().all()
    assert found["laser_scan"].isinf().all()


def test_without_what_they_are_computed_from_reliabilities_stay(make_batch: Make) -> None:
    batch = make_batch(8)
    del batch["smoothness"], batch["image"]
    found = augment(batch, with_probabilities(0, darkness=1, sector_loss=1), 0, 0)
    assert changed(batch, found) == {"points", "intensity", "point_count", "laser_scan"}


def test_failures_come_as_often_as_they_should(make_batch: Make) -> None:
    batch = {name: make_batch(200)[name] for name in ("laser_scan", "velocity_history")}
    found = augment(batch, with_probabilities(0.3, sector_loss=0.2), 0, 0)
    mirrored = (found["velocity_history"] != batch["velocity_history"]).any(2).any(1)
    lost = found["laser_scan"].isinf().sum(1) > batch["laser_scan"].isinf().sum(1)
    assert float(mirrored.float().mean()) == pytest.approx(0.3, abs=0.1)
    assert float(lost.float().mean()) == pytest.approx(0.2, abs=0.1)


def test_an_empty_batch_stays_empty(make_batch: Make) -> None:
    assert augment({}, everything(), 0, 0) == {}
    none = {name: column[:0] for name, column in make_batch().items()}
    assert len(augment(none, everything(), 0, 0)["image"]) == 0


def test_columns_needed_for_reliabilities() -> None:
    needed = columns_needed(("r_img", "r_point", "velocity_history"))
    assert needed[:3] == ("r_img", "r_point", "velocity_history")
    assert set(needed[3:]) == {"image", "points", "point_count", "smoothness"}
    assert columns_needed(("image", "laser_scan")) == ("image", "laser_scan")
    assert columns_needed(("points",)) == ("points", "point_count")


def test_added_columns_that_a_dataset_lacks_are_left_out() -> None:
    model = ("points", "point_count", "r_point")
    assert columns_needed(model, offered=model) == model


def test_a_failing_lidar_asks_for_what_r_point_follows_from() -> None:
    model = ("points", "point_count", "r_point")
    with pytest.raises(ZooError, match=r"^field: no column smoothness.* or take another\.$"):
        check_lidar_may_fail(model, model, "field", "take another")
    check_lidar_may_fail(model, (*model, "smoothness"), "field", "take another")
    check_lidar_may_fail(("points", "r_img"), model, "field", "take another")


@pytest.mark.parametrize("part", ["sector_loss", "thinning", "scatter"])
def test_a_lidar_may_fail_by_any_of_its_failures(part: str) -> None:
    whole = {key: {"probability": 0.0} for key in ("sector_loss", "thinning", "scatter")}
    assert not AugmentationSettings.model_validate(whole).lidar_may_fail
    failing = whole | {part: {"probability": 0.01}}
    assert AugmentationSettings.model_validate(failing).lidar_may_fail


def test_a_column_without_a_known_mirror_image_is_refused() -> None:
    with pytest.raises(ZooError, match="intensity_map"):
        columns_needed(("image", "intensity_map"))


@pytest.mark.parametrize(
    "wrong",
    [{"mirror": 1.2}, {"blur": {"length": [9, 3]}}, {"darkness": {"light": [0, 0.1]}}, {"flip": 1}],
)
def test_wrong_settings_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ManifestError, match=next(iter(wrong))):
        validate(wrong, AugmentationSettings, "recipe")
