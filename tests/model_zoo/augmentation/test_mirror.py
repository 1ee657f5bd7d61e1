from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from graspe_data.geometry import Transform
from graspe_data.observation.image_reliability import ImageReliabilitySettings, image_reliability
from graspe_data.observation.laser_scan import LaserScanSettings, laser_scan
from graspe_data.observation.trajectory import PredictedTrajectory
from graspe_data.robot import Intrinsics
from model_zoo.augmentation import mirror

OPTICAL = Transform(
    np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([0.2, 0.0, 0.4])
)
ALL = np.ones(3, np.bool_)
SIDED = {"image", "trajectory_image", "points", "velocity_history", "laser_scan"}

Make = Callable[..., dict[str, Tensor]]


def same(one: Tensor, other: Tensor) -> bool:
    return torch.equal(one.nan_to_num(-9), other.nan_to_num(-9))


def test_twice_is_once_more_the_same(make_batch: Make) -> None:
    batch = make_batch()
    twice = mirror(mirror(batch, ALL), ALL)
    assert all(same(twice[name], batch[name]) for name in batch)


def test_only_columns_with_a_side_change_and_the_batch_given_never(make_batch: Make) -> None:
    batch, before = make_batch(), make_batch()
    mirrored = mirror(batch, ALL)
    assert {name for name in batch if not same(mirrored[name], batch[name])} == SIDED
    assert all(mirrored[name] is batch[name] for name in batch.keys() - SIDED)
    assert all(same(batch[name], before[name]) for name in batch)


def test_only_the_rows_asked_for_are_mirrored(make_batch: Make) -> None:
    batch = make_batch()
    mirrored = mirror(batch, torch.tensor([False, True, False]))
    for name in SIDED:
        kept = [same(mirrored[name][row], batch[name][row]) for row in range(3)]
        assert kept == [True, False, True]


def test_columns_that_are_not_there_do_not_appear(make_batch: Make) -> None:
    scans = {"laser_scan": make_batch()["laser_scan"]}
    assert mirror(scans, ALL).keys() == {"laser_scan"}


@pytest.mark.parametrize(("v", "omega"), [(1.0, 0.4), (0.9, -0.6), (0.8, 0.0)])
def test_it_commutes_with_drawing_the_trajectory(v: float, omega: float) -> None:
    intrinsics = Intrinsics(width=320, height=240, fx=240, fy=240, cx=159.5, cy=119.5)
    robot = PredictedTrajectory(intrinsics, OPTICAL, 0.2, 0.5)
    drawn = torch.from_numpy(robot.draw(v, omega))[None]
    mirrored = mirror({"trajectory_image": drawn}, ALL[:1])["trajectory_image"][0].numpy()
    expected = robot.draw(v, -omega)
    assert expected.sum() > 500
    assert (mirrored != expected).sum() <= 0.01 * expected.sum()


def test_it_commutes_with_cutting_the_scan() -> None:
    random = np.random.default_rng(0)
    azimuth, distance = random.uniform(-math.pi / 2, math.pi / 2, 3000), random.uniform(1, 9, 3000)
    height = random.uniform(0, 1, 3000)
    xyz = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), height], axis=1)
    points = torch.from_numpy(xyz.astype(np.float32))[None]
    scan = torch.from_numpy(laser_scan(points[0].numpy(), 0.0, LaserScanSettings()))[None]
    mirrored = mirror({"points": points, "laser_scan": scan}, ALL[:1])
    expected = laser_scan(mirrored["points"][0].numpy(), 0.0, LaserScanSettings())
    assert np.array_equal(mirrored["laser_scan"][0].numpy(), expected)


def test_a_mirrored_picture_is_as_reliable(make_batch: Make) -> None:
    batch = make_batch()
    image = mirror(batch, ALL)["image"].numpy()
    found = [image_reliability(one, ImageReliabilitySettings()).r_img for one in image]
    assert np.allclose(found, batch["r_img"].numpy(), atol=0.01)
