"""A stage's key and its record: what was done, from what, with what result."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from graspe_data.errors import StageError
from graspe_data.manifest import Settings

RECORD = "stage.json"


class StageRecord(Settings):
    """What one stage of one recording left, stored as ``stage.json`` in its folder."""

    stage: str
    key: str
    rows: int
    columns: dict[str, str]
    """SHA-256 of each column's file."""


Record = TypeVar("Record", bound=StageRecord)


def canonical_json(content: Any) -> bytes:
    """JSON that is the same for the same content, on every machine."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def stage_key(stage: str, version: int, **inputs: Any) -> str:
    """The key of a stage: the digest of its name, version, inputs and parameters."""
    content = {"stage": stage, "version": version, **inputs}
    return hashlib.sha256(canonical_json(content)).hexdigest()


def stage_folder(episode: Path, stage: str, key: str) -> Path:
    """Where a stage with this key lies."""
    return episode / f"{stage}-{key[:16]}"


def read_record(folder: Path, model: type[Record], key: str) -> Record | None:
    """The record of a finished stage, or None where it has to be done.

    Raises:
        StageError: The folder is there, but its record is not readable or of another key.
    """
    path = folder / RECORD
    if not folder.exists():
        return None
    try:
        record = model.model_validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        raise StageError(f"{path}: damaged: delete {folder} and build again. {error}") from error
    if record.key != key:
        raise StageError(f"{path}: key {record.key}, expected {key}: delete {folder}.")
    return record


def write_record(folder: Path, record: StageRecord) -> None:
    """Write the record, as the last file of a stage."""
    content: Mapping[str, Any] = record.model_dump(mode="json")
    (folder / RECORD).write_bytes(canonical_json(content))
