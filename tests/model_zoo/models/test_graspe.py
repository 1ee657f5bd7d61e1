from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import pytest
import torch
from torch import Tensor

from model_zoo.contract import Observation, SuccessModel
from model_zoo.models.graspe import GraspeFamily
from model_zoo.registry import create_model, model_settings

Observe = Callable[[int], Observation]
NAMES = ("graspe", "graspe_no_reliability", "graspe_no_agnn")


class Watched(Mapping[str, Tensor]):
    """An observation that notes which columns are read."""

    def __init__(self, observation: Observation) -> None:
        self.observation, self.read = observation, set[str]()

    def __getitem__(self, name: str) -> Tensor:
        self.read.add(name)
        return self.observation[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.observation)

    def __len__(self) -> int:
        return len(self.observation)


@pytest.fixture(params=NAMES)
def model(request: pytest.FixtureRequest) -> SuccessModel:
    return create_model(request.param, "small")


def targets(rows: int) -> tuple[Tensor, Tensor, Tensor]:
    mask = torch.rand(rows, 10) < 0.8
    return (torch.rand(rows, 10) < 0.7).float(), mask, torch.rand(rows)


def test_probabilities_come_out_and_only_the_declared_columns_go_in(
    model: SuccessModel, observe: Observe
) -> None:
    watched = Watched(observe(2))
    found = model.eval()(watched)
    assert found.shape == (2, model.horizon) == (2, 10)
    assert found.dtype == torch.float32
    assert found.gt(0).all()
    assert found.lt(1).all()
    assert watched.read == set(model.columns)


def test_features_are_120_within_0_and_1(model: SuccessModel, observe: Observe) -> None:
    assert isinstance(model, GraspeFamily)
    vector = model.eval().encoders(observe(2)).vector
    assert vector.shape == (2, 120)
    assert vector.ge(0).all()
    assert vector.le(1).all()


def test_features_use_their_range_from_the_start(observe: Observe) -> None:
    model = create_model("graspe", "small")
    assert isinstance(model, GraspeFamily)
    assert model.encoders(observe(4)).vector.std(0).mean() > 0.15


def test_each_sensor_has_its_own_places_in_the_vector(observe: Observe) -> None:
    model = create_model("graspe", "small").eval()
    assert isinstance(model, GraspeFamily)
    observation = dict(observe(1))
    before = model.encoders(observation).vector
    for column, begin, end in (
        ("image", 0, 40),
        ("points", 40, 80),
        ("trajectory_image", 80, 100),
        ("velocity_history", 100, 120),
    ):
        changed = observation | {column: observation[column].roll(1, dims=1).flip(-1)}
        differs = model.encoders(changed).vector.ne(before)[0]
        assert differs[begin:end].any()
        assert not differs[:begin].any()
        assert not differs[end:].any()


@pytest.mark.parametrize("column", ["r_img", "r_point"])
def test_reliability_changes_graspe_and_never_its_ablations(column: str, observe: Observe) -> None:
    observation = dict(observe(2))
    changed = observation | {column: 1 - observation[column]}
    for name in NAMES:
        model = create_model(name, "small").eval()
        same = torch.equal(model(observation), model(changed))
        assert same == (name != "graspe")


def test_full_reliability_is_no_reliability(observe: Observe) -> None:
    graspe, ablation = (create_model(name, "small").eval() for name in NAMES[:2])
    ablation.load_state_dict(graspe.state_dict())
    ones = dict.fromkeys(("r_img", "r_point"), torch.ones(2))
    observation = dict(observe(2))
    assert torch.equal(graspe(observation | ones), ablation(observation))


def test_every_parameter_learns(model: SuccessModel, observe: Observe) -> None:
    loss = model.loss(observe(3), *targets(3))
    loss.total.backward()  # type: ignore[no-untyped-call]
    missing = [
        name
        for name, parameter in model.named_parameters()
        if parameter.grad is None or not parameter.grad.isfinite().all()
    ]
    assert not missing


def test_the_loss_is_the_contracts_and_a_penalty_where_features_are_aligned(
    observe: Observe,
) -> None:
    points = {"channels": (8, 16, 32), "align_features": True}
    model = create_model("graspe", "small", encoders={"points": points}).eval()
    observation, (success, mask, weight) = observe(2), targets(2)
    loss = model.loss(observation, success, mask, weight)
    expected = SuccessModel.loss(model, observation, success, mask, weight).total
    torch.testing.assert_close(loss.parts["cross_entropy"], expected)
    torch.testing.assert_close(loss.total, expected + loss.parts["orthogonality"])


def test_no_points_and_no_trajectory_still_give_a_prediction(
    model: SuccessModel, observe: Observe
) -> None:
    observation = dict(observe(1))
    observation["point_count"] = torch.zeros(1, dtype=torch.int32)
    observation["points"] = torch.full_like(observation["points"], torch.nan)
    observation["trajectory_image"] = torch.zeros_like(observation["trajectory_image"])
    assert model.eval()(observation).isfinite().all()


def test_the_printed_sizes() -> None:
    model = create_model("graspe", "paper")
    assert isinstance(model, GraspeFamily)
    trunk, attention, fc = 11_176_512, 89_880, 512 * 40 + 40
    count = sum(parameter.numel() for parameter in model.encoders.image.parameters())
    assert count == trunk + attention + fc


@pytest.mark.parametrize("preset", ["paper", "small"])
def test_the_ablations_have_graspes_encoders(preset: str) -> None:
    numbers = [model_settings(name, preset).model_dump() for name in NAMES]
    assert numbers[0] == numbers[1]
    assert numbers[0]["encoders"] == numbers[2]["encoders"]
