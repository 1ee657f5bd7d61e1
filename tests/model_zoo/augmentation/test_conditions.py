from __future__ import annotations

from collections.abc import Callable
from typing import cast

import pytest
import torch
from torch import Tensor

from graspe_data.errors import ZooError
from model_zoo.augmentation import (
    CONDITIONS,
    FAILING_SENSOR,
    KNOWN_CONDITIONS,
    Condition,
    apply_condition,
    chosen_conditions,
)

Make = Callable[..., dict[str, Tensor]]

STRANGE: tuple[Condition, ...] = ("strange_camera", "strange_lidar")
FAILING = [name for name in FAILING_SENSOR if name not in STRANGE]
OF_CAMERA = [name for name in FAILING if FAILING_SENSOR[name] == "camera"]
OF_LIDAR = [name for name in FAILING if FAILING_SENSOR[name] == "lidar"]


def same(one: Tensor, other: Tensor) -> bool:
    return torch.equal(one.nan_to_num(-9), other.nan_to_num(-9))


def test_the_conditions() -> None:
    assert CONDITIONS == ("clean", "dark", "blurred", "covered", "lidar_sector_lost")
    assert {"clean", *FAILING, *STRANGE} == {*KNOWN_CONDITIONS}
    assert chosen_conditions() == CONDITIONS
    assert chosen_conditions(["all"]) == KNOWN_CONDITIONS
    assert chosen_conditions(["glare", "clean"]) == ("glare", "clean")


@pytest.mark.parametrize("names", [[], ["foggy"], ["dark", "dark"], ["all", "dark"]])
def test_a_choice_that_is_none_is_refused(names: list[str]) -> None:
    with pytest.raises(ZooError, match="give one or more, once each, of clean, dark"):
        chosen_conditions(names)


def test_clean_changes_nothing(make_batch: Make) -> None:
    batch = make_batch()
    found = apply_condition(batch, "clean", 0)
    assert all(found[name] is batch[name] for name in batch)


@pytest.mark.parametrize("condition", ["dark", "blurred", "covered"])
def test_every_picture_gets_less_reliable(make_batch: Make, condition: Condition) -> None:
    batch = make_batch()
    found = apply_condition(batch, condition, 0)
    assert (found["r_img"] < batch["r_img"]).all()
    assert same(found["points"], batch["points"])


@pytest.mark.parametrize("condition", OF_CAMERA)
def test_a_failing_camera_changes_pictures_alone(make_batch: Make, condition: Condition) -> None:
    batch = make_batch()
    found = apply_condition(batch, condition, 0)
    assert (found["image"] != batch["image"]).flatten(1).any(1).all()
    assert all(same(found[name], batch[name]) for name in ("points", "laser_scan", "r_point"))


@pytest.mark.parametrize("condition", OF_LIDAR)
def test_a_failing_lidar_changes_clouds_and_scans_alone(
    make_batch: Make, condition: Condition
) -> None:
    batch = make_batch()
    batch["laser_scan"] = torch.full_like(batch["laser_scan"], 6)
    found = apply_condition(batch, condition, 0)
    assert not same(found["points"], batch["points"])
    assert not same(found["laser_scan"], batch["laser_scan"])
    assert torch.equal(found["image"], batch["image"])
    assert torch.equal(found["r_img"], batch["r_img"])


@pytest.mark.parametrize("condition", ["dust", "near_leaves"])
def test_what_is_before_the_lidar_returns_from_nearer(
    make_batch: Make, condition: Condition
) -> None:
    batch = make_batch()
    found = apply_condition(batch, condition, 0)
    before, now = (each["points"].norm(dim=2) for each in (batch, found))
    assert torch.equal(found["point_count"], batch["point_count"])
    nearer = (now < before - 1e-4) & ~before.isnan()
    assert nearer.any()
    assert (now[nearer] > 0.4).all()


def test_every_cloud_and_scan_loses_a_right_angle(make_batch: Make) -> None:
    batch = make_batch()
    batch["laser_scan"] = torch.ones_like(batch["laser_scan"])
    found = apply_condition(batch, "lidar_sector_lost", 0)
    assert (found["point_count"] < batch["point_count"]).all()
    lost = found["laser_scan"].isinf().sum(1)
    assert (abs(lost - 360) <= 1).all()
    assert torch.equal(found["image"], batch["image"])


@pytest.mark.parametrize("condition", FAILING)
def test_a_row_with_a_stamp_fails_alike_in_any_batch(
    make_batch: Make, condition: Condition
) -> None:
    batch = make_batch(4)
    whole = apply_condition(batch, condition, 7)
    turned = apply_condition({name: c.flip(0) for name, c in batch.items()}, condition, 7)
    assert all(same(turned[name].flip(0), whole[name]) for name in batch)


@pytest.mark.parametrize("condition", FAILING)
def test_without_a_stamp_the_place_in_the_call_counts(
    make_batch: Make, condition: Condition
) -> None:
    batch = make_batch(4)
    del batch["stamp_ns"]
    whole = apply_condition(batch, condition, 7)
    first = apply_condition({name: column[:2] for name, column in batch.items()}, condition, 7)
    assert all(same(first[name], whole[name][:2]) for name in batch)
    other = apply_condition(batch, condition, 8)
    assert not all(same(other[name], whole[name]) for name in batch)


def test_an_unknown_condition_is_refused(make_batch: Make) -> None:
    with pytest.raises(ZooError, match="dark"):
        apply_condition(make_batch(), cast("Condition", "foggy"), 0)


def test_a_strange_sensor_says_what_it_says_of_another_row(make_batch: Make) -> None:
    batch = make_batch(6)
    camera, lidar = (apply_condition(batch, name, 0) for name in STRANGE)
    for name in batch:
        of_camera = name in ("image", "r_bright", "r_corners", "r_img")
        of_lidar = name in ("points", "intensity", "smoothness", "point_count", "laser_scan")
        of_lidar |= name in ("r_edge", "r_planar", "r_point")
        for found, changed in ((camera, of_camera), (lidar, of_lidar)):
            other = batch[name].roll(3, 0)
            assert same(found[name], other if changed else batch[name])
    alone = make_batch(1)
    assert all(same(apply_condition(alone, "strange_lidar", 0)[n], alone[n]) for n in alone)
