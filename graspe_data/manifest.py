"""Manifests: YAML files read into validated, frozen models."""

from __future__ import annotations

import difflib
import reprlib
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from graspe_data.errors import ManifestError

MAXIMUM_BYTES = 4 << 20
NOT_YAML = (yaml.YAMLError, RecursionError, ValueError, LookupError, AttributeError)
"""What the loader raises on a text that is not YAML."""

Kind = Literal["robots", "datasets", "models", "recipes", "scenarios", "conditions", "examinations"]

Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]


class Settings(BaseModel):
    """Base of every manifest and of every group of parameters: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


Model = TypeVar("Model", bound=BaseModel)


def shipped_manifests() -> Path:
    """The folder of the manifests that ship, in a wheel as in a checkout."""
    package = Path(__file__).resolve().parent
    installed = package / "manifests"
    return installed if installed.is_dir() else package.parent / "manifests"


def find_manifest(kind: Kind, name: str | Path, beside: Path | None = None) -> Path:
    """Find a manifest by path, or by the name of one that ships.

    Args:
        kind: The folder of shipped manifests to look in.
        name: A path, absolute or relative to ``beside`` or to the current folder, or a bare name.
        beside: Folder of the manifest that refers to this one.

    Raises:
        ManifestError: Nothing of that name; the text lists the names that ship.
    """
    folder = shipped_manifests() / kind
    candidates = [Path(name), folder / f"{name}.yaml"]
    if beside is not None:
        candidates.insert(0, beside / name)
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    known = sorted(path.stem for path in folder.glob("*.yaml"))
    nearest = difflib.get_close_matches(str(name), known, n=1, cutoff=0.5)
    advice = f" Did you mean {nearest[0]!r}?" if nearest else ""
    where = "" if beside is None else f" beside {beside} or here"
    raise ManifestError(
        f"{kind}: no manifest {str(name)!r}: no such file{where}, and those that ship are "
        f"{', '.join(known) or 'none'}.{advice}"
    )


def read_yaml(path: Path) -> Any:
    """Read one YAML document, without tags or objects.

    Raises:
        ManifestError: The file is missing, too large, not YAML, has aliases, or gives a key twice.
    """
    text = read_text(path)
    try:
        return StrictLoader(text).get_single_data()
    except NOT_YAML as error:
        raise ManifestError(f"{path}: not valid YAML: {error}") from error


def read_text(path: Path) -> str:
    """The text of a manifest.

    Raises:
        ManifestError: The file is missing, too large, or not UTF-8.
    """
    try:
        if path.stat().st_size > MAXIMUM_BYTES:
            raise ManifestError(f"{path}: larger than {MAXIMUM_BYTES} bytes, so not a manifest.")
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ManifestError(f"{path}: cannot be read: {error}") from error


class StrictLoader(yaml.SafeLoader):
    """A key that is given twice is a mistake, where YAML's own loader takes the last.

    So are aliases: a few lines of them stand for more values than memory holds.
    """

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose a node, as the base class does, that is no alias."""
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not allowed; write the value out")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Make a mapping, as the base class does, of keys that differ."""
        seen = set()
        for key, _ in node.value:
            if (key.tag, str(key.value)) in seen:
                place = f"line {key.start_mark.line + 1}"
                raise yaml.YAMLError(f"{place}: the key {key.value!r} is given twice")
            seen.add((key.tag, str(key.value)))
        return super().construct_mapping(node, deep)


def load_manifest(path: Path, model: type[Model]) -> Model:
    """Read and validate a manifest.

    Raises:
        ManifestError: Names the file and, for each fault, the key, what was found and what fits.
    """
    content = read_yaml(path)
    if not isinstance(content, dict):
        found = type(content).__name__
        raise ManifestError(f"{path}: expected a mapping at the top, found {found}.")
    return validate(content, model, str(path))


def validate(content: dict[str, Any], model: type[Model], where: str) -> Model:
    """Validate a mapping; ``where`` is named in the error."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        faults = "\n".join(f"  {describe_fault(fault, model)}" for fault in error.errors())
        raise ManifestError(f"{where}: not a valid {model.__name__}:\n{faults}") from error


def describe_fault(fault: ErrorDetails, model: type[BaseModel]) -> str:
    """One fault that validation found: the key, what is wrong, what was found or is known."""
    key = ".".join(str(part) for part in fault["loc"]) or "the whole"
    if fault["type"] == "value_error":
        return f"{key}: {fault['msg'].removeprefix('Value error, ')}."
    if fault["type"] != "extra_forbidden":
        return f"{key}: {fault['msg']} (found {reprlib.repr(fault['input'])})."
    known = _known_keys(model, fault["loc"][:-1])
    return f"{key}: unknown key.{_suggestion(str(fault['loc'][-1]), known)}"


def _known_keys(model: Any, location: tuple[int | str, ...]) -> list[str]:
    """The keys that the model at a location accepts; follows lists, mappings and unions."""
    models = _models_within(model)
    for part in location:
        fields = [m.model_fields[str(part)] for m in models if str(part) in m.model_fields]
        if fields:
            models = [inner for field in fields for inner in _models_within(field.annotation)]
    return sorted({key for found in models for key in found.model_fields})


def _models_within(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    inner = getattr(annotation, "__args__", ())
    return [found for argument in inner for found in _models_within(argument)]


def _suggestion(name: str, known: list[str]) -> str:
    nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    if nearest:
        return f" Did you mean {nearest[0]!r}?"
    return f" Known here: {', '.join(known)}." if known else ""
