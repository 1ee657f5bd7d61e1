"""A bundle's folder, which appears whole or not at all."""

from __future__ import annotations

import hashlib
import secrets
import shutil
from collections.abc import Mapping
from pathlib import Path

from graspe_data.atomic_file import PARTIAL_SUFFIX, write_atomically
from graspe_data.bundle_contract import SEAL_FILE, SEALED_FILES, BundleSeal, SealedFile
from graspe_data.errors import ZooError
from graspe_data.shards.dataset_manifest import canonical_json


def write_bundle(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Write the files and their seal under a temporary name, then rename the folder.

    A bundle that stood there is replaced.

    Raises:
        ZooError: Something else lies there, or it cannot be written.
    """
    check_place(folder)
    token = secrets.token_hex(4)
    partial, old = (
        folder.with_name(f".{folder.name}.{token}.{part}{PARTIAL_SUFFIX}")
        for part in ("new", "old")
    )
    try:
        partial.mkdir(parents=True)
        for name, content in files.items():
            write_atomically(partial / name, [content], ZooError)
        write_atomically(partial / SEAL_FILE, [_seal(files)], ZooError)
        if folder.exists():
            folder.rename(old)
        partial.rename(folder)
    except OSError as error:
        raise ZooError(f"{folder}: cannot be written: {error.strerror}.") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)
    return folder


def check_place(folder: Path) -> None:
    """Refuse a place that holds something other than a bundle.

    Raises:
        ZooError: It names what lies there.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ZooError(f"{folder}: is a file. Give another folder to --out.")
    others = sorted({path.name for path in folder.iterdir()} - SEALED_FILES - {SEAL_FILE})
    if others:
        raise ZooError(
            f"{folder}: holds other files ({', '.join(others[:3])}), so it is no place for a "
            "bundle. Give a new folder to --out."
        )


def _seal(files: Mapping[str, bytes]) -> bytes:
    sealed = {
        name: SealedFile(bytes=len(content), sha256=hashlib.sha256(content).hexdigest())
        for name, content in files.items()
    }
    return (canonical_json(BundleSeal(files=sealed).model_dump(mode="json")) + "\n").encode()
