"""What blind references said, kept by the digest of all that it follows from.

Every evaluation shows them, and they are the same for every model on the same rows.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ZooError

Arrays = dict[str, NDArray[Any]]

CACHE_VARIABLE: Final = "GRASPE_CACHE"
"""Names the folder; empty keeps nothing. Without it ``graspe`` in the user's cache folder."""


def cache_folder() -> Path | None:
    """Where it is kept; None where nothing is to be kept."""
    named = os.environ.get(CACHE_VARIABLE)
    if named is not None:
        return Path(named) if named else None
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "graspe"


def kept_or_made(digest: str, make: Callable[[], Arrays]) -> Arrays:
    """The arrays of a digest: those kept, else made and kept.

    A file that is damaged is made again; a folder that cannot be written keeps nothing.

    Args:
        digest: Of all that they follow from.
        make: Makes them.
    """
    folder = cache_folder()
    if folder is None:
        return make()
    file = folder / f"blind-{digest}.npz"
    try:
        with np.load(file, allow_pickle=False) as kept:
            return {name: kept[name] for name in kept.files}
    except (OSError, ValueError, BadZipFile, KeyError):
        made = make()
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **made)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(file, [content.getvalue()], ZooError)
    except (OSError, ZooError):
        return made
    return made
