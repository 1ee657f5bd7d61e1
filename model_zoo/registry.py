"""The models of the zoo by name, and their presets."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, find_manifest, load_manifest, validate
from model_zoo.contract import SuccessModel
from model_zoo.models.graspe import Graspe, GraspeSettings
from model_zoo.models.graspe_no_agnn import GraspeNoAgnn, GraspeNoAgnnSettings
from model_zoo.models.graspe_no_reliability import GraspeNoReliability
from model_zoo.models.nmfnet import Nmfnet
from model_zoo.models.nmfnet_family import NmfnetSettings
from model_zoo.models.nmfnet_trajectory import NmfnetTrajectory, NmfnetTrajectorySettings
from model_zoo.models.paad import Paad, PaadSettings
from model_zoo.planned_model import plan_model


class _Entry(NamedTuple):
    build: Callable[[Any], SuccessModel]
    settings: type[Settings]


MODELS: Mapping[str, _Entry] = {
    "graspe": _Entry(Graspe, GraspeSettings),
    "graspe_no_agnn": _Entry(GraspeNoAgnn, GraspeNoAgnnSettings),
    "graspe_no_reliability": _Entry(GraspeNoReliability, GraspeSettings),
    "nmfnet": _Entry(Nmfnet, NmfnetSettings),
    "nmfnet_trajectory": _Entry(NmfnetTrajectory, NmfnetTrajectorySettings),
    "paad": _Entry(Paad, PaadSettings),
}
"""Every model: its class, made from an object of its settings."""


class ModelManifest(Settings):
    """What ships of a model beside its code.

    Attributes:
        presets: Settings by the preset's name; what a preset leaves out has its default.
    """

    presets: dict[str, dict[str, Any]]


def list_models() -> dict[str, tuple[str, ...]]:
    """The models' names, each with the names of its presets."""
    return {name: tuple(_presets(name)) for name in MODELS}


def model_settings(name: str, preset: str = "paper", **overrides: Any) -> Settings:
    """The numbers of a model; ``model_dump()`` of them as overrides give the same again.

    Args:
        name: One of :func:`list_models`.
        preset: ``paper``, the sizes printed, or ``small``, which trains on two cores.
        overrides: Settings that differ; a mapping replaces only the keys that it names.

    Raises:
        ZooError: An unknown name, preset or setting, or a value that does not fit.
    """
    entry = MODELS[_known("model", name, MODELS)]
    presets = _presets(name)
    numbers = presets[_known(f"preset of {name}", preset, presets)]
    try:
        return validate(_merge(numbers, overrides), entry.settings, f"{name}, preset {preset}")
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
        return MODELS[name].build(settings)

    plan_model(make, f"{name}, preset {preset}")
    return make()


def _presets(name: str) -> dict[str, dict[str, Any]]:
    try:
        return load_manifest(find_manifest("models", name), ModelManifest).presets
    except ManifestError as error:
        raise ZooError(str(error)) from error


def _known(what: str, name: str, known: Iterable[str]) -> str:
    names = sorted(known)
    if name in names:
        return name
    nearest = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    advice = f" Did you mean {nearest[0]!r}?" if nearest else ""
    raise ZooError(f"no {what} {name!r}: known are {', '.join(names)}.{advice}")


def _merge(numbers: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(numbers)
    for key, value in overrides.items():
        inner = merged.get(key)
        both = isinstance(inner, Mapping) and isinstance(value, Mapping)
        merged[key] = _merge(inner, value) if both else value  # type: ignore[arg-type]
    return merged
