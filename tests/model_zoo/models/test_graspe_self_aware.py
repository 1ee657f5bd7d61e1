from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from model_zoo.contract import Observation
from model_zoo.models.graspe_self_aware import GraspeSelfAware
from model_zoo.registry import create_model

Observe = Callable[[int], Observation]


def a_model(**overrides: float) -> GraspeSelfAware:
    model = create_model("graspe_self_aware", "small", **overrides)
    assert isinstance(model, GraspeSelfAware)
    return model


def targets(rows: int) -> tuple[Tensor, Tensor, Tensor]:
    return (torch.rand(rows, 10) < 0.7).float(), torch.rand(rows, 10) < 0.8, torch.rand(rows)


def expects(model: GraspeSelfAware, sensor: str, error: float) -> None:
    """Let a sensor foretell the same error of itself in every scene."""
    last = getattr(model, sensor).foreteller[2]
    torch.nn.init.zeros_(last.weight)
    torch.nn.init.constant_(last.bias, error)


@pytest.mark.parametrize(("column", "sensor"), [("image", "picture"), ("points", "cloud")])
def test_a_sensor_that_expects_to_be_wrong_is_not_heard(
    column: str, sensor: str, observe: Observe
) -> None:
    model = a_model().eval()
    observation = dict(observe(2))
    other = observation | {column: observation[column].flip(0).roll(3, dims=1)}
    assert not torch.equal(model(observation), model(other))
    expects(model, sensor, 1000.0)
    assert torch.equal(model(observation), model(other))


def test_sensors_that_expect_no_error_give_what_graspe_gives(observe: Observe) -> None:
    graspe, model = create_model("graspe", "small").eval(), a_model().eval()
    model.load_state_dict(graspe.state_dict(), strict=False)
    for sensor in ("picture", "cloud"):
        expects(model, sensor, -1000.0)
    observation = observe(2)
    torch.testing.assert_close(model(observation), graspe(observation))


def test_what_is_foretold_does_not_teach_the_features(observe: Observe) -> None:
    model = a_model(judge_weight=0.0)
    success, mask, weight = targets(3)
    loss = model.loss(observe(3), success, mask, weight)
    loss.parts["foretelling"].backward()  # type: ignore[no-untyped-call]
    taught = {name for name, each in model.named_parameters() if each.grad is not None}
    assert taught
    assert all(".foreteller." in name for name in taught)


def test_the_parts_of_the_loss_are_those_of_each_row(observe: Observe) -> None:
    model = a_model(sensor_dropout=0.0).eval()
    observation, (success, mask, _) = observe(3), targets(3)
    loss = model.loss(observation, success, mask, torch.ones(3))
    judged = model.judge(model.encoders(observation).vector, observation)
    entropy, wrong = 0.0, 0.0
    for each in (judged.picture, judged.cloud):
        for row in range(3):
            steps = mask[row]
            true = binary_cross_entropy_with_logits(each.logits[row, steps], success[row, steps])
            entropy += true.item() / 3
            away = abs(true.item() - each.error[row].item())
            wrong += (away**2 / 2 if away < 1 else away - 0.5) / 3
    assert loss.parts["judges"].item() == pytest.approx(entropy, rel=1e-4)
    assert loss.parts["foretelling"].item() == pytest.approx(wrong, rel=1e-4)


def test_an_error_is_learnt_where_the_reliability_tells_it() -> None:
    """A picture that is right where r_img is 1 and noise where it is 0, and a cloud of noise."""
    torch.manual_seed(0)
    model = a_model()
    judge = model.picture
    optimiser = torch.optim.Adam(judge.parameters(), 0.01)
    for _ in range(300):
        r = (torch.rand(256) < 0.5).float()
        truth = (torch.rand(256, 1) < 0.5).float()
        seen = torch.where(r[:, None] == 1, truth, torch.rand(256, 1)).repeat(1, 40)
        judged = judge(seen, torch.zeros(256, 40), torch.stack((r, torch.ones(256)), 1))
        entropy = binary_cross_entropy_with_logits(
            judged.logits, truth.repeat(1, 10), reduction="none"
        ).mean(1)
        optimiser.zero_grad()
        (entropy.mean() + (judged.error - entropy.detach()).square().mean()).backward()
        optimiser.step()
    assert judged.error[r == 0].mean() > 0.4
    assert judged.error[r == 1].mean() < 0.2


def test_candidates_in_one_scene_are_judged_as_in_scenes_of_their_own(observe: Observe) -> None:
    model = a_model().eval()
    scene = dict(observe(1))
    drawings = torch.rand(3, 240, 320) > 0.9
    scores = model.score(model.encode(scene), scene | {"trajectory_image": drawings})
    for row in range(3):
        alone = model.logits(scene | {"trajectory_image": drawings[row : row + 1]})
        torch.testing.assert_close(scores[row : row + 1], alone, atol=1e-5, rtol=1e-5)
