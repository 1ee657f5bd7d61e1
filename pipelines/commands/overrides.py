"""Settings given on the command line: ``--set graph.decay=5``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import typer
import yaml


def read_overrides(words: Sequence[str]) -> dict[str, Any]:
    """Turn words such as ``graph.decay=5`` into nested mappings; values are read as YAML.

    Raises:
        typer.BadParameter: A word is no setting, or one is given twice.
    """
    overrides: dict[str, Any] = {}
    for word in words:
        key, separator, text = word.partition("=")
        names = key.split(".")
        if not separator or not all(names):
            raise typer.BadParameter(f"{word!r}: expected NAME=VALUE, such as graph.decay=5")
        _put(overrides, names, _value(word, text), word)
    return overrides


def _put(into: dict[str, Any], names: Sequence[str], value: Any, word: str) -> None:
    for name in names[:-1]:
        into = into.setdefault(name, {})
        if not isinstance(into, dict):
            raise typer.BadParameter(f"{word!r}: {name} is given as a value too")
    if names[-1] in into:
        raise typer.BadParameter(f"{word!r}: {'.'.join(names)} is given twice")
    into[names[-1]] = value


def _value(word: str, text: str) -> Any:
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError) as error:
        raise typer.BadParameter(f"{word!r}: its value is no YAML: {error}") from error
