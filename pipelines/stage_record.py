"""A stage's key and its record: what was done, from what, with what result."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from graspe_data.documents import canonical_json, file_digest
from graspe_data.manifest import Settings

RECORD = "stage.json"


class StageRecord(Settings):
    """What one stage of one recording left, stored as ``stage.json`` in its folder."""

    stage: str
    key: str
    rows: int
    columns: dict[str, str]
    """SHA-256 of each column's file."""

    @property
    def files(self) -> dict[str, str]:
        """SHA-256 of every file of the stage, by file name."""
        return {f"{name}.npy": digest for name, digest in self.columns.items()}


Record = TypeVar("Record", bound=StageRecord)


def stage_key(stage: str, version: int, **inputs: Any) -> str:
    """The key of a stage: the digest of its name, version, inputs and parameters."""
    content = {"stage": stage, "version": version, **inputs}
    return hashlib.sha256(_text(content)).hexdigest()


def stage_folder(episode: Path, stage: str, key: str) -> Path:
    """Where a stage with this key lies."""
    return episode / f"{stage}-{key[:16]}"


def read_record(folder: Path, model: type[Record], key: str) -> Record | None:
    """The record of a finished stage, or None where it has to be done.

    A stage whose record or files are damaged is removed, to be done again.
    """
    if not folder.exists():
        return None
    try:
        content = (folder / RECORD).read_bytes()
        record = model.model_validate_json(content.partition(b"\n")[0])
        if content == _sealed(record) and record.key == key and _intact(folder, record):
            return record
    except (OSError, ValidationError):
        pass
    shutil.rmtree(folder)
    return None


def _intact(folder: Path, record: StageRecord) -> bool:
    return all(file_digest(folder / name) == digest for name, digest in record.files.items())


def write_record(folder: Path, record: StageRecord) -> None:
    """Write the record, as the last file of a stage."""
    (folder / RECORD).write_bytes(_sealed(record))


def _sealed(record: StageRecord) -> bytes:
    """The record's JSON, and on a line of its own the digest of that."""
    content = _text(record.model_dump(mode="json"))
    return content + b"\n" + hashlib.sha256(content).hexdigest().encode()


def _text(content: Mapping[str, Any]) -> bytes:
    return canonical_json(content, indent=None).encode()
