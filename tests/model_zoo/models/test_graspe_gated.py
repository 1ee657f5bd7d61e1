from __future__ import annotations

from collections.abc import Callable

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from model_zoo.contract import Observation
from model_zoo.models.graspe_gated import (
    PIECES,
    GraspeGated,
    GraspePlainReliability,
    ReliabilityGate,
    kept_sensors,
)
from model_zoo.registry import create_model

Observe = Callable[[int], Observation]
heights = st.lists(st.floats(-20, 20), min_size=PIECES + 1, max_size=PIECES + 1)


def a_gate(values: list[float]) -> ReliabilityGate:
    gate = ReliabilityGate()
    gate.load_state_dict({"heights": torch.tensor(values)})
    return gate


def closed_at_0(model: GraspeGated) -> GraspeGated:
    """A model whose gates let nothing pass of a sensor of reliability 0."""
    for gate in (model.picture_gate, model.cloud_gate):
        gate.heights.data[0] = -1000
    return model.eval()


@given(heights, st.lists(st.floats(0, 1), min_size=2, max_size=20))
def test_a_gate_never_falls_and_lies_within_0_and_1(
    values: list[float], reliabilities: list[float]
) -> None:
    shares = a_gate(values)(torch.tensor(sorted(reliabilities)))
    assert shares.ge(0).all()
    assert shares.le(1 + 1e-6).all()
    assert shares.diff().ge(-1e-6).all()


@given(heights)
def test_full_reliability_opens_a_gate_wholly(values: list[float]) -> None:
    torch.testing.assert_close(a_gate(values)(torch.ones(1)), torch.ones(1))


def test_a_gate_begins_as_a_line() -> None:
    r = torch.linspace(0, 1, 33)
    torch.testing.assert_close(ReliabilityGate()(r), (1 + PIECES * r) / (1 + PIECES))


def test_sound_sensors_give_what_graspe_gives(observe: Observe) -> None:
    graspe, gated = (create_model(name, "small").eval() for name in ("graspe", "graspe_gated"))
    missing = gated.load_state_dict(graspe.state_dict(), strict=False).missing_keys
    assert sorted(missing) == ["cloud_gate.heights", "picture_gate.heights"]
    ones = dict.fromkeys(("r_img", "r_point"), torch.ones(2))
    observation = dict(observe(2)) | ones
    torch.testing.assert_close(gated(observation), graspe(observation))


@pytest.mark.parametrize(("column", "reliability"), [("image", "r_img"), ("points", "r_point")])
def test_a_closed_gate_hides_a_sensor_that_graspe_still_hears(
    column: str, reliability: str, observe: Observe
) -> None:
    gated, graspe = create_model("graspe_gated", "small"), create_model("graspe", "small").eval()
    assert isinstance(gated, GraspeGated)
    observation = dict(observe(2)) | {reliability: torch.zeros(2)}
    other = observation | {column: observation[column].flip(0).roll(3, dims=1)}
    assert torch.equal(closed_at_0(gated)(observation), gated(other))
    assert not torch.equal(graspe(observation), graspe(other))


def test_candidates_in_one_scene_share_its_reliabilities(observe: Observe) -> None:
    model = create_model("graspe_gated", "small").eval()
    scene = dict(observe(1))
    drawings = torch.rand(3, 240, 320) > 0.9
    scores = model.score(model.encode(scene), scene | {"trajectory_image": drawings})
    for row in range(3):
        alone = model.logits(scene | {"trajectory_image": drawings[row : row + 1]})
        torch.testing.assert_close(scores[row : row + 1], alone, atol=1e-5, rtol=1e-5)


def test_training_drops_one_sensor_at_a_time_as_often_as_said() -> None:
    picture, cloud = kept_sensors(20_000, 0.4, torch.device("cpu"))
    assert (picture + cloud).ge(1).all()
    for kept in (picture, cloud):
        assert kept.eq(0).float().mean().item() == pytest.approx(0.2, abs=0.02)


def test_nothing_is_dropped_outside_training(observe: Observe) -> None:
    model = create_model("graspe_gated", "small", sensor_dropout=0.9).eval()
    observation = observe(3)
    assert torch.equal(model(observation), model(observation))


def reliabilities_of(model: GraspePlainReliability) -> Tensor:
    return model.reliabilities.weight


def test_the_control_without_its_two_inputs_is_graspe_without_reliability(
    observe: Observe,
) -> None:
    names = ("graspe_no_reliability", "graspe_plain_reliability")
    ablation, control = (create_model(name, "small").eval() for name in names)
    assert isinstance(control, GraspePlainReliability)
    control.load_state_dict(ablation.state_dict(), strict=False)
    observation = observe(2)
    assert not torch.allclose(control(observation), ablation(observation))
    reliabilities_of(control).data.zero_()
    torch.testing.assert_close(control(observation), ablation(observation))
