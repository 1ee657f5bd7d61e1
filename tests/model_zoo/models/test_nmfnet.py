from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import nn

from graspe_data.errors import ZooError
from model_zoo.contract import Observation, SuccessModel
from model_zoo.models.nmfnet import _PlacewiseFusion
from model_zoo.registry import create_model

Observe = Callable[[int], Observation]
NAMES = ("nmfnet", "nmfnet_trajectory")


def count(module: nn.Module) -> int:
    return sum(p.numel() for p in module.parameters())


@pytest.fixture(params=NAMES)
def small(request: pytest.FixtureRequest) -> SuccessModel:
    return create_model(request.param, "small").eval()


def test_parameter_counts() -> None:
    plain, path = (create_model(name, "paper") for name in NAMES)
    assert count(plain) == 3_915_091
    assert count(path) == 3_915_091 + 5_888 + 41_024 + 64 * 10


def test_the_parts_parameter_counts() -> None:
    scene = create_model("nmfnet").scene
    assert isinstance(scene, nn.Module)
    counts = {name: count(part) for name, part in scene.named_children()}
    assert counts == {
        "image": 309_984,
        "point_net": 2_803_529,
        "fusion": 328_064,
        "draw": 0,
        "map": 308_384,
    }


def test_only_its_columns_are_read(small: SuccessModel, observe: Observe) -> None:
    observation = observe(3)
    found = small({name: observation[name] for name in small.columns})
    assert found.shape == (3, 10)
    assert torch.all((found > 0) & (found < 1))
    torch.testing.assert_close(found, small(observation))


def test_each_column_changes_the_output(small: SuccessModel, observe: Observe) -> None:
    observation = observe(2)
    before = small(observation)
    for name in small.columns:
        changed = {**observation, name: torch.zeros_like(observation[name])}
        assert not torch.allclose(small(changed), before, rtol=0, atol=1e-7), name


def test_only_variant_b_sees_the_trajectory(observe: Observe) -> None:
    observation = observe(1)
    other = {**observation, "trajectory_image": ~observation["trajectory_image"]}
    plain, path = (create_model(name, "small").eval() for name in NAMES)
    assert torch.equal(plain(other), plain(observation))
    assert not torch.equal(path(other), path(observation))


def test_every_parameter_learns(small: SuccessModel, observe: Observe) -> None:
    mask = torch.ones(3, 10, dtype=torch.bool)
    loss = small.train().loss(observe(3), torch.zeros(3, 10), mask, torch.ones(3))
    gradients = torch.autograd.grad(loss.total, list(small.parameters()))
    assert all(torch.isfinite(gradient).all() for gradient in gradients)


def test_fusion_is_two_1x1_convolutions_over_the_tiled_vector() -> None:
    fusion = _PlacewiseFusion(6, 9, (5, 4)).eval()
    maps, vector = torch.randn(3, 6, 2, 4), torch.randn(3, 9)
    tiled = torch.cat((maps, vector[:, :, None, None].expand(-1, -1, 2, 4)), dim=1)
    torch.testing.assert_close(fusion(maps, vector), fusion.rest(fusion.join(tiled)))


def test_another_number_of_rays_is_refused(small: SuccessModel, observe: Observe) -> None:
    observation = {**observe(1), "laser_scan": torch.ones(1, 360)}
    with pytest.raises(ZooError, match="found 360 rays, expected 720"):
        small(observation)
