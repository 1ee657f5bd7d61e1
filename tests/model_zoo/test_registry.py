from __future__ import annotations

import pytest

from graspe_data.errors import ZooError
from graspe_data.manifest import shipped_manifests
from model_zoo.registry import create_model, list_models, model_settings


def test_every_model_ships_presets_that_validate() -> None:
    models = list_models()
    shipped = {path.stem for path in (shipped_manifests() / "models").glob("*.yaml")}
    assert shipped <= set(models)
    for name, presets in models.items():
        assert {"paper", "small"} <= set(presets)
        assert all(model_settings(name, preset) for preset in presets)


def test_settings_as_overrides_give_the_same_again() -> None:
    for name in list_models():
        settings = model_settings(name, "small", horizon=7)
        assert model_settings(name, "paper", **settings.model_dump()) == settings


def test_a_mapping_replaces_only_the_keys_it_names() -> None:
    changed = model_settings("graspe", "small", graph={"decay": 3.5}).model_dump()
    expected = model_settings("graspe", "small").model_dump()
    expected["graph"]["decay"] = 3.5
    assert changed == expected


def test_a_preset_may_be_named() -> None:
    assert model_settings("paad", preset="small") == model_settings("paad", "small")


def test_overrides_reach_the_model() -> None:
    assert create_model("graspe", "small", horizon=3).horizon == 3


@pytest.mark.parametrize(
    ("name", "preset", "overrides", "text"),
    [
        ("grasp", "paper", {}, r"no model 'grasp': known are graspe, .*Did you mean 'graspe'\?"),
        ("graspe", "smal", {}, r"no preset of graspe 'smal': known are .*Did you mean 'small'\?"),
        ("graspe", "small", {"horizn": 3}, r"graspe, preset small: .*Did you mean 'horizon'\?"),
        ("graspe", "small", {"graph": {"decay": 0}}, r"graph.decay: .*greater than 0 \(found 0\)"),
        ("graspe", "small", {"horizon": "ten"}, "horizon: .*integer"),
    ],
)
def test_what_is_unknown_is_refused_with_a_suggestion(
    name: str, preset: str, overrides: dict[str, object], text: str
) -> None:
    with pytest.raises(ZooError, match=f"(?s){text}"):
        create_model(name, preset, **overrides)
