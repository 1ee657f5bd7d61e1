"""How a checkpoint was trained, in short: what tells trainings of one model apart."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from graspe_data.documents import Sha256, canonical_json
from graspe_data.manifest import Settings

_SHORT = 8

Value = bool | int | float | str | None


class RecipeSummary(Settings):
    """A recipe without its seed.

    Attributes:
        digest: SHA-256 of all its values.
        values: Its values; of a group of values the beginning of the group's digest.
    """

    digest: Sha256
    values: Mapping[str, Value]

    @property
    def short(self) -> str:
        """The beginning of the digest, for people."""
        return self.digest[:_SHORT]


def summarise_recipe(recipe: Any) -> RecipeSummary | None:
    """The summary of a checkpoint's recipe; None where that is no mapping of plain values."""
    if not isinstance(recipe, Mapping):
        return None
    content = {str(name): value for name, value in recipe.items() if name != "seed"}
    try:
        values = {name: _value(value) for name, value in content.items()}
        return RecipeSummary(digest=digest_of(content), values=values)
    except (ValueError, TypeError):
        return None


def _value(value: Any) -> Value:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    return digest_of({"value": value})[:_SHORT]


def digest_of(content: Mapping[str, Any]) -> str:
    """SHA-256 of values that JSON has, whatever their order."""
    return hashlib.sha256(canonical_json(content).encode()).hexdigest()
