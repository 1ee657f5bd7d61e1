"""A table of figures, shown and kept."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path


def publish(lines: Sequence[str], out: Path | None) -> None:
    """Print the lines of a table, and write them to a file where one is named."""
    table = "\n".join(lines) + "\n"
    sys.stdout.write(table)
    if out:
        out.write_text(table)
