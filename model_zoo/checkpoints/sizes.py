"""How large the numbers of a checkpoint's model may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from graspe_data.errors import ZooError

LARGEST_NUMBER = 1 << 20


def check_sizes(numbers: Any, where: Path) -> None:
    """Refuse what no model is as large as, before anything of that size is made.

    Args:
        numbers: Settings as JSON has them.
        where: Their file, for the error's text.

    Raises:
        ZooError: A whole number among them is too large.
    """
    if isinstance(numbers, Mapping):
        numbers = list(numbers.values())
    if isinstance(numbers, Sequence) and not isinstance(numbers, str):
        for inner in numbers:
            check_sizes(inner, where)
    elif isinstance(numbers, int) and abs(numbers) > LARGEST_NUMBER:
        raise ZooError(f"{where}: a number is {numbers}, expected at most {LARGEST_NUMBER}.")
