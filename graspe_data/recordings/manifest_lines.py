"""YAML with a comment at every line, for people to go through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import yaml

_PLAIN_EXTRAS: Final = "/_.-"
_COMMENT_COLUMN: Final = 44
_WIDTH: Final = 110


@dataclass(frozen=True)
class ManifestLine:
    """A key at a depth, its value (None opens a mapping), and a comment."""

    depth: int
    key: str
    value: str | float | bool | tuple[float, ...] | None = None
    note: str = ""


def manifest_text(source: str, lines: Sequence[ManifestLine]) -> str:
    """The manifest; names from a recording are quoted so that they stay one value each."""
    head = [
        f"# A robot manifest, begun from {_one_line(source)} by `graspe scaffold`.",
        "# Check every `guess`, and fill in every `missing`, before building a dataset with it.",
    ]
    return "\n".join([*head, *map(_line, lines)]) + "\n"


def _line(line: ManifestLine) -> str:
    value = "" if line.value is None else " " + _value(line.value)
    text = f"{'  ' * line.depth}{line.key}:{value}"
    if not line.note:
        return text
    noted = f"{text:<{_COMMENT_COLUMN}}  # {_one_line(line.note)}"
    above = f"{'  ' * line.depth}# {_one_line(line.note)}\n{text}"
    return noted if len(noted) <= _WIDTH else above


def _value(value: str | float | bool | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(str, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return _quoted(value) if isinstance(value, str) else str(value)


def _quoted(text: str) -> str:
    """Plain where YAML reads it back as the same text, else in double quotes."""
    if text in ("null", "{}"):
        return text
    simple = text.isascii() and all(c.isalnum() or c in _PLAIN_EXTRAS for c in text)
    if simple and yaml.safe_load(f"key: {text}") == {"key": text}:
        return text
    quoted = yaml.safe_dump(text, default_style='"', width=1 << 30, allow_unicode=False)
    return str(quoted).strip()


def _one_line(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)
