"""The files of a bundle, read once, with their sizes and digests checked."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel

from graspe_data.bundle_contract import (
    CONTRACT_FILE,
    ENCODE_GRAPH,
    SCORE_GRAPH,
    SEAL_FILE,
    SEALED_FILES,
    BundleContract,
    BundleSeal,
    SealedFile,
)
from graspe_data.errors import ManifestError, PlannerError
from graspe_data.links import check_link
from graspe_data.manifest import validate

LARGEST_DOCUMENT = 4 << 20
LARGEST_FILE = 2 << 30

Model = TypeVar("Model", bound=BaseModel)

_AGAIN = "Export the bundle again with `graspe export`, or copy it again."


def read_bundle_files(folder: Path) -> tuple[BundleContract, Mapping[str, bytes]]:
    """Read the contract and the graphs of a bundle after all of its files were checked.

    Returns:
        The contract, and the bytes of ``ENCODE_GRAPH`` and ``SCORE_GRAPH``.

    Raises:
        PlannerError: A file is missing, a link that is not followed, not what the seal says, or
            does not validate.
    """
    seal = _parsed(folder / SEAL_FILE, _read(folder / SEAL_FILE, LARGEST_DOCUMENT), BundleSeal)
    if set(seal.files) != SEALED_FILES:
        expected, found = ", ".join(sorted(SEALED_FILES)), ", ".join(sorted(seal.files))
        raise PlannerError(
            f"{folder / SEAL_FILE}: lists {found or 'nothing'}, expected {expected}. {_AGAIN}"
        )
    kept: dict[str, bytes] = {}
    for name in sorted(SEALED_FILES):
        content = _sealed(folder / name, seal.files[name])
        if name in (ENCODE_GRAPH, SCORE_GRAPH, CONTRACT_FILE):
            kept[name] = content
    contract = _parsed(folder / CONTRACT_FILE, kept.pop(CONTRACT_FILE), BundleContract)
    return contract, kept


def _sealed(path: Path, seal: SealedFile) -> bytes:
    """The content of a file that is what its seal says."""
    if seal.bytes > LARGEST_FILE:
        raise PlannerError(f"{path}: sealed as {seal.bytes} bytes, more than {LARGEST_FILE}.")
    content = _read(path, seal.bytes)
    if len(content) != seal.bytes:
        raise PlannerError(f"{path}: {len(content)} bytes, sealed as {seal.bytes}. {_AGAIN}")
    digest = hashlib.sha256(content).hexdigest()
    if digest != seal.sha256:
        raise PlannerError(f"{path}: SHA-256 {digest}, sealed as {seal.sha256}. {_AGAIN}")
    return content


def _read(path: Path, most: int) -> bytes:
    """A file's content, which is at most so long; its size is checked before it is read."""
    check_link(path, path.parent, PlannerError)
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise PlannerError(f"{path}: expected a file. {_AGAIN}")
        if size > most:
            raise PlannerError(f"{path}: {size} bytes, expected at most {most}. {_AGAIN}")
        return path.read_bytes()
    except FileNotFoundError as error:
        raise PlannerError(
            f"{path}: missing, so {path.parent} is no finished bundle. {_AGAIN}"
        ) from error
    except OSError as error:
        raise PlannerError(f"{path}: cannot be read: {error.strerror or error}.") from error


def _parsed(path: Path, content: bytes, model: type[Model]) -> Model:
    try:
        document: Any = json.loads(content, object_pairs_hook=_unique)
    except (ValueError, RecursionError) as error:
        raise PlannerError(f"{path}: not valid JSON: {error}. {_AGAIN}") from error
    if not isinstance(document, dict):
        raise PlannerError(f"{path}: a {type(document).__name__}, expected a mapping. {_AGAIN}")
    try:
        return validate(document, model, str(path))
    except ManifestError as error:
        raise PlannerError(f"{error}\n{_AGAIN}") from error


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        (twice, _), *_ = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"the key {twice!r} stands twice")
    return mapping
