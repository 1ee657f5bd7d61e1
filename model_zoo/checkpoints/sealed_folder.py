"""A folder whose files are listed with their SHA-256 in ``manifest.json``, written last."""

from __future__ import annotations

import hashlib
import json
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ManifestError, ZooError
from graspe_data.links import check_link
from graspe_data.manifest import Settings, validate
from graspe_data.shards.dataset_manifest import Sha256, canonical_json

SEAL_NAME = "manifest.json"
_LARGEST_SEAL = 1 << 20
_AGAIN = "Copy the checkpoint again from where it was made, or train it again."


class SealedFile(Settings):
    """Size and digest of a file."""

    bytes: Annotated[int, Field(ge=0)]
    sha256: Sha256


class Seal(Settings):
    """The content of ``manifest.json``."""

    format: Literal["graspe-checkpoint-1"] = "graspe-checkpoint-1"
    files: Mapping[str, SealedFile]


def write_sealed(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files, then the seal; a seal that stood there is taken away first.

    Raises:
        ZooError: The folder cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / SEAL_NAME).unlink(missing_ok=True)
    except OSError as error:
        raise ZooError(f"{folder}: cannot be made or written: {error.strerror}.") from error
    for name, content in files.items():
        write_atomically(folder / name, [content], ZooError)
    sealed = {
        name: SealedFile(bytes=len(content), sha256=hashlib.sha256(content).hexdigest())
        for name, content in files.items()
    }
    text = canonical_json(Seal(files=sealed).model_dump(mode="json")) + "\n"
    write_atomically(folder / SEAL_NAME, [text.encode()], ZooError)


def check_sealed(folder: Path, expected: frozenset[str]) -> str:
    """Compare every file with the seal.

    Args:
        folder: The checkpoint.
        expected: The names that must be sealed.

    Returns:
        SHA-256 of the seal itself, which names the checkpoint.

    Raises:
        ZooError: Names the file that is missing, or of another size or content.
    """
    content = read_bounded(folder / SEAL_NAME, _LARGEST_SEAL)
    seal = _parse(folder / SEAL_NAME, content)
    if seal.files.keys() != expected:
        wrong = ", ".join(sorted(seal.files.keys() ^ expected))
        raise ZooError(f"{folder / SEAL_NAME}: lists other files than a checkpoint has: {wrong}.")
    for name, entry in seal.files.items():
        _check_file(folder / name, entry)
    return hashlib.sha256(content).hexdigest()


def read_bounded(path: Path, limit: int) -> bytes:
    """Read a file of at most ``limit`` bytes.

    Raises:
        ZooError: It is missing, larger, no regular file, a link that is not followed, or cannot be
            read.
    """
    try:
        _check_regular(path)
        with path.open("rb") as file:
            content = file.read(limit + 1)
    except FileNotFoundError as error:
        raise ZooError(
            f"{path}: missing, so {path.parent} is no finished checkpoint. Give the folder that "
            "training wrote, or run the training again to finish."
        ) from error
    except OSError as error:
        raise ZooError(f"{path}: cannot be read: {error.strerror}.") from error
    if len(content) > limit:
        raise ZooError(f"{path}: larger than {limit} bytes. {_AGAIN}")
    return content


def _parse(path: Path, content: bytes) -> Seal:
    try:
        parsed = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ZooError(f"{path}: not valid JSON: {error}. {_AGAIN}") from error
    if not isinstance(parsed, dict):
        raise ZooError(f"{path}: expected a mapping, found {type(parsed).__name__}. {_AGAIN}")
    try:
        return validate(parsed, Seal, str(path))
    except ManifestError as error:
        raise ZooError(f"{error}\n{_AGAIN}") from error


def _check_regular(path: Path) -> None:
    """Before it is opened: to open a pipe waits for who writes to it."""
    check_link(path, path.parent, ZooError)
    if not stat.S_ISREG(path.stat().st_mode):
        raise ZooError(f"{path}: expected a regular file, found something else. {_AGAIN}")


def _check_file(path: Path, entry: SealedFile) -> None:
    try:
        _check_regular(path)
        with path.open("rb") as file:
            size = path.stat().st_size
            digest = hashlib.file_digest(file, "sha256").hexdigest() if size == entry.bytes else ""
    except OSError as error:
        raise ZooError(f"{path}: cannot be read: {error.strerror}. {_AGAIN}") from error
    if size != entry.bytes:
        raise ZooError(f"{path}: has {size} bytes, the seal says {entry.bytes}. {_AGAIN}")
    if digest != entry.sha256:
        raise ZooError(
            f"{path}: was changed or damaged: SHA-256 {digest}, the seal says {entry.sha256}. "
            f"{_AGAIN}"
        )
