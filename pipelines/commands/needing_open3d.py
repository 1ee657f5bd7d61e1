"""Commands that cast rays need Open3D, which is an extra."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from graspe_data.errors import StageError


@contextmanager
def needing_open3d(command: str) -> Iterator[None]:
    """Around an import: where Open3D is missing, say what to install for a command.

    Raises:
        StageError: Open3D is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "open3d":
            raise
        raise StageError(
            f"{command} casts its rays with Open3D, which is not installed: "
            f"pip install 'graspe[simulation]'."
        ) from error
