"""Where an evaluation goes: a name that tells what it is of, and a place that takes it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile

from graspe_data.errors import ZooError
from model_zoo.augmentation import CONDITIONS

_USUAL_SPLIT = "test"


def evaluation_name(split: str, conditions: Sequence[str], every: int) -> str:
    """``evaluation.json`` for all rows of ``test`` under all conditions; else names what is not so.

    A quick evaluation so never takes the place of a fuller one.
    """
    parts = ["evaluation"]
    if split != _USUAL_SPLIT:
        parts.append(split.replace("/", "_"))
    if tuple(conditions) != tuple(CONDITIONS):
        parts += conditions
    if every > 1:
        parts.append(f"every_{every}")
    return "-".join(parts) + ".json"


def check_writable(file: Path) -> None:
    """Refuse, before any work is done, a file that could not be written after it.

    Raises:
        ZooError: Something other than a regular file is there, or its folder cannot be written.
    """
    if file.exists() and not file.is_file():
        kind = "a folder" if file.is_dir() else "no regular file"
        raise ZooError(f"{file}: is {kind}; expected the path of a file. Give another with --out.")
    try:
        with TemporaryFile(dir=file.parent):
            pass
    except OSError as error:
        raise ZooError(
            f"{file}: cannot be written: {error.strerror}. Make its folder, let it be written, or "
            "give another with --out."
        ) from error
