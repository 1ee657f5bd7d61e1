"""Every number of every preset and recipe has its bounds, and one clear error beyond them."""

from __future__ import annotations

import math
from typing import Any

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, validate
from model_zoo.contract import SuccessModel
from model_zoo.planned_model import MOST_PARAMETERS, plan_model
from model_zoo.registry import MODELS, create_model, list_models, model_settings
from model_zoo.training.machine import Machine
from model_zoo.training.recipe import Recipe
from tests.model_zoo.number_bounds import Number, numbers, with_number
from tests.model_zoo.training.smallest import SMALLEST, make_rows

SETTINGS: dict[str, type[Settings]] = {name: model.settings_type for name, model in MODELS.items()}
OTHERS: dict[str, tuple[type[Settings], dict[str, Any]]] = {
    "recipe": (Recipe, Recipe(augmentation={}).model_dump(mode="json")),
    "machine": (Machine, Machine().model_dump(mode="json")),
}
OF_MODELS = [(name, number) for name, model in SETTINGS.items() for number in numbers(model)]
OF_OTHERS = [(name, number) for name, (model, _) in OTHERS.items() for number in numbers(model)]
EVERY = OF_MODELS + OF_OTHERS


def named(case: tuple[str, Number]) -> str:
    return f"{case[0]}-{case[1]}"


def smallest(name: str) -> dict[str, Any]:
    return model_settings(name, "small", **SMALLEST[name]).model_dump(mode="json")


def given_to(name: str, number: Number, value: object) -> None:
    """Validate settings with one number changed, as a preset or a recipe is."""
    if name in OTHERS:
        model, content = OTHERS[name]
        validate(with_number(content, number.place, value), model, name)
    else:
        model_settings(name, "small", **with_number(smallest(name), number.place, value))


def planned(name: str, number: Number, value: object) -> SuccessModel | None:
    """The model without memory; None where the numbers together make none, and it is said."""
    try:
        chosen = model_settings(name, "small", **with_number(smallest(name), number.place, value))
        return plan_model(lambda: MODELS[name](chosen), name)
    except ZooError:
        return None


def outside(number: Number) -> tuple[st.SearchStrategy[float], st.SearchStrategy[float]]:
    """Values below and above its bounds."""
    low, high = number.lowest(), number.highest()
    if number.whole:
        return st.integers(max_value=int(low) - 1), st.integers(min_value=int(high) + 1)
    return (
        st.floats(max_value=low, exclude_max=True, allow_nan=False),
        st.floats(min_value=high, exclude_min=True, allow_nan=False),
    )


def test_there_are_many() -> None:
    assert len(OF_MODELS) > 100
    assert {"graph.hidden", "encoders.points.channels.2"} <= {str(n) for _, n in OF_MODELS}
    assert {"epochs", "augmentation.blur.length.1"} <= {str(n) for _, n in OF_OTHERS}


@pytest.mark.parametrize("case", EVERY, ids=named)
def test_every_number_has_two_bounds(case: tuple[str, Number]) -> None:
    _, number = case
    assert number.least is not None
    assert number.most is not None
    assert number.least < number.most < 1e20


@pytest.mark.slow
@settings(deadline=None, max_examples=300)
@given(st.data())
def test_beyond_its_bounds_one_error_names_the_number(data: st.DataObject) -> None:
    name, number = data.draw(st.sampled_from(EVERY))
    truths = [] if name == "machine" else [True, False]
    odd: st.SearchStrategy[object] = st.sampled_from([*truths, math.nan, math.inf, "many", []])
    value = data.draw(st.one_of(*outside(number), odd))
    with pytest.raises((ZooError, ManifestError)) as error:
        given_to(name, number, value)
    faults = str(error.value).splitlines()[1:]
    message = [line.strip().replace("augmentation: ", "augmentation.") for line in faults]
    assert all(line.startswith(str(number)) for line in message), message
    assert len(faults) <= 2  # of alternatives, such as a word or a number, one each


@pytest.mark.slow
@settings(deadline=None, max_examples=150)
@given(st.data())
def test_within_its_bounds_it_makes_a_model_or_an_error_in_words(data: st.DataObject) -> None:
    name, number = data.draw(st.sampled_from(OF_MODELS))
    low, high = number.lowest(), number.highest()
    between: st.SearchStrategy[float] = (
        st.integers(int(low), int(high)) if number.whole else st.floats(low, high)
    )
    value = data.draw(st.one_of(st.sampled_from([low, high]), between))
    model = planned(name, number, int(value) if number.whole else value)
    if model is not None:
        assert 0 < sum(weight.numel() for weight in model.parameters()) <= MOST_PARAMETERS


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_at_every_lower_bound_the_model_predicts_or_there_is_an_error_in_words(name: str) -> None:
    rows = {key: torch.from_numpy(column) for key, column in make_rows(3, 0, 0).items()}
    tried, made = numbers(SETTINGS[name]), 0
    for number in tried:
        lowest = int(number.lowest()) if number.whole else number.lowest()
        content = with_number(smallest(name), number.place, lowest)
        try:
            model = create_model(name, "small", **content).eval()
            with torch.inference_mode():
                found = model.logits({key: rows[key] for key in model.columns})
        except ZooError:
            continue
        made += 1
        assert found.shape == (3, model.horizon)
        assert found.isfinite().all(), number
    assert made >= min(6, len(tried) // 2)


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("graspe", {"graph": {"hidden": 0}}, r"graph\.hidden: .* greater than or equal to 1 "),
        ("graspe", {"graph": {"heads": 0}}, r"graph\.heads: .* greater than or equal to 1 "),
        ("graspe", {"graph": {"dropout": 1.5}}, r"graph\.dropout: .* less than 1 "),
        ("graspe", {"graph": {"hidden": 10**9}}, r"graph\.hidden: .* less than or equal to 16384 "),
        ("graspe", {"graph": {"hidden": True}}, r"graph\.hidden: .*integer"),
        ("graspe_no_agnn", {"convolutions": {"channels": 0}}, r"convolutions\.channels: "),
        ("paad", {"dropout": True}, "dropout: expected a number, found true"),
        ("paad", {"path_rows": 241}, "path_rows 241 are more than the 240 rows"),
        ("paad", {"picture_size": [200, 320], "path_rows": 201}, "path_rows 201 are more than"),
        ("nmfnet_trajectory", {"path_rows": 300}, "path_rows 300 are more than the 240 rows"),
        ("nmfnet", {"picture_size": [4, 320]}, "is too small: ResNet8 makes nothing of it"),
        ("nmfnet", {"shrink": 64}, "is too small: ResNet8 makes nothing of it"),
        ("paad", {"shrink": 64}, "these numbers make no model"),
        ("paad", {"trunk_width": 1024, "hidden": 16384, "beams": 65536}, "parameters, expected at"),
        (
            "nmfnet",
            {"point_net": {"channels": [16384] * 3, "hidden": [16384] * 2}},
            "parameters, expected at most",
        ),
    ],
)
def test_what_was_seen_to_go_wrong(name: str, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ZooError, match=message) as error:
        create_model(name, "small", **changes)
    assert len(str(error.value).splitlines()) <= 2


def test_planning_draws_nothing_from_the_generator() -> None:
    for name in MODELS:
        torch.manual_seed(5)
        first = create_model(name, "small", **SMALLEST[name])
        torch.manual_seed(5)
        chosen = model_settings(name, "small", **SMALLEST[name])
        second = MODELS[name](chosen)
        pairs = zip(first.state_dict().values(), second.state_dict().values(), strict=True)
        assert all(torch.equal(*pair) for pair in pairs)


def test_presets_that_ship_are_within() -> None:
    for name, presets in list_models().items():
        for preset in presets:
            content = model_settings(name, preset).model_dump(mode="json")
            assert model_settings(name, preset, **content) == model_settings(name, preset)
