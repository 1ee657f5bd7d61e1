"""A bundle's folder, which appears whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from graspe_data.bundle_contract import BUNDLE
from graspe_data.errors import ZooError
from graspe_data.sealed_folder import SEAL_FILE
from graspe_data.whole_folder import replaced_folder


def write_bundle(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Write the files and their seal under a temporary name, then rename the folder.

    A bundle that stood there is replaced.

    Raises:
        ZooError: Something else lies there, or it cannot be written.
    """
    check_place(folder)
    try:
        with replaced_folder(folder) as made:
            replace(BUNDLE, refusal=ZooError).write(made, files)
    except OSError as error:
        raise ZooError(f"{folder}: cannot be written: {error.strerror}.") from error
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
    others = sorted({path.name for path in folder.iterdir()} - BUNDLE.files - {SEAL_FILE})
    if others:
        raise ZooError(
            f"{folder}: holds other files ({', '.join(others[:3])}), so it is no place for a "
            "bundle. Give a new folder to --out."
        )
