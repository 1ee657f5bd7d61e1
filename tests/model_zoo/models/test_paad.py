from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor, nn
from torch.nn.functional import binary_cross_entropy

from graspe_data.errors import ZooError
from model_zoo.contract import Observation
from model_zoo.layers.picture_input import normalised_picture
from model_zoo.models.paad import Paad, PaadSettings
from model_zoo.registry import create_model

Observe = Callable[[int], Observation]


@pytest.fixture(scope="module")
def paper() -> Paad:
    return Paad(PaadSettings(beams=1081, freeze_trunk=True)).eval()


@pytest.fixture
def small() -> Paad:
    model = create_model("paad", "small", alpha=2.0)
    assert isinstance(model, Paad)
    return model.eval()


def count(module: nn.Module, learned: bool) -> int:
    return sum(p.numel() for p in module.parameters() if p.requires_grad is learned)


def test_published_parameter_counts(paper: Paad) -> None:
    assert count(paper, learned=False) == 11_471_488
    assert count(paper, learned=True) == 439_459
    assert count(paper.fusion.attention, learned=True) == 16_640
    assert count(paper.fusion.head, learned=True) == 25_994


def test_this_datasets_scans_need_fewer_parameters() -> None:
    model = create_model("paad", "paper")
    assert count(model, learned=False) == 0
    assert count(model, learned=True) == 11_471_488 + 346_682


def test_published_feature_maps(paper: Paad, observe: Observe) -> None:
    with torch.inference_mode():
        reduced = paper.image.reduced(normalised_picture(observe(1)["image"]))
        assert reduced.shape == (1, 64, 4, 5)
        assert paper.image.convolution(reduced).shape == (1, 32, 4, 5)
        assert paper.path.feature_map(observe(1)["trajectory_image"]).shape == (1, 32, 4, 5)


def test_the_trunk_has_torchvisions_tensors_without_the_last_layer(paper: Paad) -> None:
    state = paper.image.resnet.state_dict()
    assert len(state) == 122 - 2
    assert {"conv1.weight", "bn1.running_var", "layer4.0.downsample.1.bias"} <= set(state)
    assert count(paper.image.resnet, learned=False) == 11_176_512


def test_only_its_columns_are_read(small: Paad, observe: Observe) -> None:
    observation = observe(3)
    found = small({name: observation[name] for name in Paad.columns})
    assert found.shape == (3, 10)
    assert torch.all((found > 0) & (found < 1))
    assert torch.equal(found, small(observation))


@pytest.mark.parametrize("column", Paad.columns)
def test_each_column_changes_the_output(small: Paad, observe: Observe, column: str) -> None:
    observation = dict(observe(2))
    before = small(observation)
    observation[column] = torch.zeros_like(observation[column])
    assert not torch.allclose(small(observation), before, rtol=0, atol=1e-7)


def loss_by_hand(model: Paad, observation: Observation, success: Tensor) -> Tensor:
    """The published formula, utils.py, written over probabilities of failure."""
    scan = observation["laser_scan"].clamp(0, 4.5) / 4.5
    posterior = model.scan.encode(scan)
    mean, log_variance = posterior.mean, posterior.log_variance
    rebuilt = model.scan.decoder(mean)
    error = ((scan - rebuilt) ** 2).sum()
    divergence = -0.5 * (1 + log_variance - mean**2 - log_variance.exp()).sum()
    failure = 1 - model(observation)
    entropy = binary_cross_entropy(failure, 1 - success, reduction="sum")
    total: Tensor = (error + divergence + model.alpha * entropy) / len(scan)
    return total


def test_the_loss_is_the_published_one(small: Paad, observe: Observe) -> None:
    observation = observe(4)
    success = torch.randint(0, 2, (4, 10)).float()
    loss = small.loss(observation, success, torch.ones(4, 10, dtype=torch.bool), torch.ones(4))
    torch.testing.assert_close(loss.total, loss_by_hand(small, observation, success))
    assert set(loss.parts) == {"reconstruction", "divergence", "cross_entropy"}


def test_weights_count_rows_as_often(small: Paad, observe: Observe) -> None:
    observation, success = observe(2), torch.randint(0, 2, (2, 10)).float()
    mask = torch.rand(2, 10) > 0.3
    twice = torch.tensor([0, 0, 1])
    repeated = small.loss(
        {name: column[twice] for name, column in observation.items()},
        success[twice],
        mask[twice],
        torch.ones(3),
    )
    weighed = small.loss(observation, success, mask, torch.tensor([2.0, 1.0]))
    torch.testing.assert_close(weighed.total, repeated.total)


def test_steps_that_are_not_judged_do_not_count(small: Paad, observe: Observe) -> None:
    observation, success = observe(2), torch.ones(2, 10)
    mask = torch.arange(10).expand(2, 10) < 4
    flipped = torch.where(mask, success, 1 - success)
    losses = [small.loss(observation, y, mask, torch.ones(2)).total for y in (success, flipped)]
    assert torch.equal(losses[0], losses[1])


def test_every_parameter_learns(small: Paad, observe: Observe) -> None:
    mask = torch.ones(3, 10, dtype=torch.bool)
    loss = small.train().loss(observe(3), torch.zeros(3, 10), mask, torch.ones(3))
    gradients = torch.autograd.grad(loss.total, list(small.parameters()))
    assert all(torch.isfinite(gradient).all() for gradient in gradients)


def test_alpha_follows_the_number_of_batches(observe: Observe) -> None:
    model = create_model("paad", "small")
    assert isinstance(model, Paad)
    with pytest.raises(ZooError, match="begin_training"):
        model.loss(observe(1), torch.ones(1, 10), torch.ones(1, 10).bool(), torch.ones(1))
    model.begin_training(621)
    assert model.alpha == pytest.approx(6.21)
    model.begin_training(2853)
    assert model.alpha == pytest.approx(28.53)


def test_a_given_alpha_stays(small: Paad) -> None:
    small.begin_training(621)
    assert small.alpha == 2.0


def test_another_number_of_rays_is_refused(paper: Paad, observe: Observe) -> None:
    with pytest.raises(ZooError, match="found 720 rays, expected 1081"):
        paper(observe(1))


def test_heads_that_do_not_divide_the_features_are_refused() -> None:
    with pytest.raises(ZooError, match="no multiple of heads"):
        create_model("paad", features=60)
