"""JSON documents and digests: the same content gives the same bytes; what is read is checked."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, StringConstraints

from graspe_data.errors import GraspeError, ManifestError
from graspe_data.manifest import validate

Sha256 = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
"""A digest in hexadecimal."""

Model = TypeVar("Model", bound=BaseModel)


def canonical_json(content: Mapping[str, Any], *, indent: int | None = 2) -> str:
    """JSON with sorted keys; the same content gives the same text, on every machine.

    Args:
        content: Of what JSON has.
        indent: Spaces of a level; None puts all on one line, without a space.

    Raises:
        ValueError: A NaN or an infinity, which JSON does not have.
        TypeError: Something else that JSON does not have.
    """
    separators = (",", ":") if indent is None else (",", ": ")
    return json.dumps(
        content, sort_keys=True, indent=indent, separators=separators, allow_nan=False
    )


def file_digest(path: Path) -> str:
    """The SHA-256 of a file, in hexadecimal; OSError where it cannot be read."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def parse_document(
    content: bytes, model: type[Model], where: Path, refusal: type[GraspeError], remedy: str
) -> Model:
    """A JSON document as the model that it should be.

    Args:
        content: Of its file.
        model: What it should be.
        where: The file, for the error's text.
        refusal: The error of the caller's room.
        remedy: What to do about a damaged document, a sentence.

    Raises:
        refusal: It is not JSON, no mapping, or each fault with its key.
    """
    try:
        return validate(parse_mapping(content, where, refusal, remedy), model, str(where))
    except ManifestError as error:
        raise refusal(f"{error}\n{remedy}") from error


def parse_mapping(
    content: bytes, where: Path, refusal: type[GraspeError], remedy: str
) -> dict[str, Any]:
    """A JSON document whose outermost value is a mapping; arguments as in :func:`parse_document`.

    Raises:
        refusal: It is not JSON, gives a key twice, or is no mapping.
    """
    try:
        document = json.loads(content, object_pairs_hook=_unique)
    except (ValueError, RecursionError) as error:
        raise refusal(f"{where}: not valid JSON: {error}. {remedy}") from error
    if not isinstance(document, dict):
        found = type(document).__name__
        raise refusal(f"{where}: expected a mapping, found {found}. {remedy}")
    return document


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        (twice, _), *_ = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"the key {twice!r} stands twice")
    return mapping
