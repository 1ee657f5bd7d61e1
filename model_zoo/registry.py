"""The models of the zoo by name, and their presets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, validate
from model_zoo.contract import SuccessModel
from model_zoo.known_models import SHIPPED, known_models, nearest_of
from model_zoo.planned_model import plan_model
from model_zoo.presets import merged, presets_of

MODELS: Mapping[str, type[SuccessModel]] = SHIPPED
"""The models of this project; :func:`list_models` also knows those registered from outside."""


def list_models() -> dict[str, tuple[str, ...]]:
    """The models' names, each with the names of its presets."""
    return {name: tuple(presets_of(name)) for name in known_models()}


def model_settings(name: str, preset: str = "paper", **overrides: Any) -> Settings:
    """The numbers of a model; ``model_dump()`` of them as overrides give the same again.

    Args:
        name: One of :func:`list_models`.
        preset: ``paper``, the sizes printed, or ``small``, which trains on two cores.
        overrides: Settings that differ; a mapping replaces only the keys that it names.

    Raises:
        ZooError: An unknown name, preset or setting, or a value that does not fit.
    """
    model, presets = _model_class(name), presets_of(name)
    if preset not in presets:
        raise ZooError(f"no preset of {name} {preset!r}: {nearest_of(preset, presets)}")
    numbers = merged(presets[preset], overrides)
    try:
        return validate(numbers, model.settings_type, f"{name}, preset {preset}")
    except ManifestError as error:
        raise ZooError(str(error)) from error


def create_model(name: str, preset: str = "paper", **overrides: Any) -> SuccessModel:
    """Make a model with random weights, from torch's generator.

    Args:
        name: One of :func:`list_models`.
        preset: ``paper`` or ``small``.
        overrides: Settings that differ; see :func:`model_settings`.

    Raises:
        ZooError: An unknown name, preset or setting, a value that does not fit, or values that
            together make no model.
    """
    settings = model_settings(name, preset, **overrides)

    def make() -> SuccessModel:
        return _model_class(name)(settings)

    plan_model(make, f"{name}, preset {preset}")
    return make()


def _model_class(name: str) -> type[SuccessModel]:
    models = known_models()
    if name in models:
        return models[name]
    raise ZooError(
        f"no model {name!r}: {nearest_of(name, models)} A model of your own is registered by an "
        "entry point in the group graspe.models, or by its module's name in GRASPE_MODELS; see "
        "docs/zoo.md."
    )
