"""The presets of models: YAML files, of which one may extend another's."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, load_manifest, shipped_manifests
from model_zoo.known_models import known_models

Presets = dict[str, dict[str, Any]]


class ModelManifest(Settings):
    """The numbers of a model, beside its code.

    Attributes:
        extends: The model whose presets these begin with.
        without: Settings of that model which this one does not have.
        presets: Settings by the preset's name; what a preset leaves out is as in the model that it
            extends, or has its default.
    """

    extends: str | None = None
    without: tuple[str, ...] = ()
    presets: Presets = Field(default_factory=dict)


def presets_of(name: str) -> Presets:
    """The presets of a known model.

    They lie in ``manifests/models/NAME.yaml``, or as ``NAME.yaml`` beside the module of a model
    from outside. Where there is no file, ``paper`` and ``small`` are the defaults of its settings.

    Raises:
        ZooError: The file is no manifest of a model, or extends none.
    """
    return _presets(name, ())


def merged(numbers: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers, and what replaces them; of a mapping only the keys that are named."""
    result = dict(numbers)
    for key, value in overrides.items():
        inner = result.get(key)
        both = isinstance(inner, Mapping) and isinstance(value, Mapping)
        result[key] = merged(inner, value) if both else value  # type: ignore[arg-type]
    return result


def _presets(name: str, extended_by: tuple[str, ...]) -> Presets:
    path = _manifest(name)
    if not path.is_file():
        return {"paper": {}, "small": {}}
    try:
        manifest = load_manifest(path, ModelManifest)
    except ManifestError as error:
        raise ZooError(str(error)) from error
    parent = manifest.extends
    if parent is None:
        return manifest.presets
    if parent not in known_models() or parent in (*extended_by, name):
        raise ZooError(f"{path}: extends {parent!r}, expected another model that is known.")
    return _extended(_presets(parent, (*extended_by, name)), manifest)


def _extended(parents: Presets, manifest: ModelManifest) -> Presets:
    names = dict.fromkeys((*parents, *manifest.presets))
    kept = {
        preset: {key: value for key, value in numbers.items() if key not in manifest.without}
        for preset, numbers in parents.items()
    }
    return {name: merged(kept.get(name, {}), manifest.presets.get(name, {})) for name in names}


def _manifest(name: str) -> Path:
    beside = Path(inspect.getfile(known_models()[name])).with_name(f"{name}.yaml")
    return beside if beside.is_file() else shipped_manifests() / "models" / f"{name}.yaml"
