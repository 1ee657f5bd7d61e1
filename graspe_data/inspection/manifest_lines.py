"""YAML with a comment at every line, for people to go through."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import yaml

from graspe_data.manifest import read_yaml

_PLAIN_EXTRAS: Final = "/_.-"
_COMMENT_COLUMN: Final = 44
_WIDTH: Final = 110
_MISSING: Final = re.compile(r"#\s*missing:")


@dataclass(frozen=True)
class ManifestLine:
    """A key at a depth, its value (None opens a mapping), and a comment."""

    depth: int
    key: str
    value: str | float | bool | tuple[float, ...] | None = None
    note: str = ""


def manifest_text(source: str, lines: Sequence[ManifestLine], remarks: Sequence[str] = ()) -> str:
    """The manifest; names from a recording are quoted so that they stay one value each."""
    head = [
        f"# A robot manifest, begun from {_one_line(source)} by `graspe scaffold`.",
        "# Check every `guess`, and fill in every `missing`, before building a dataset with it.",
        *(f"# {_one_line(remark)}" for remark in remarks),
    ]
    return "\n".join([*head, *map(_line, lines)]) + "\n"


def unfilled(path: Path) -> list[str]:
    """The keys, dotted, of the lines of a manifest that are still marked ``# missing``.

    The mark is on the key's line or in a comment right above it.

    Raises:
        ManifestError: The file cannot be read, or is not YAML.
    """
    read_yaml(path)
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    keys = _keys(yaml.compose(text, yaml.SafeLoader))
    return [key for key, first, end in keys if _is_marked(lines, first, end)]


def _keys(node: yaml.Node | None, parent: str = "") -> Iterator[tuple[str, int, tuple[int, int]]]:
    """Each key of a mapping in block style and below, its line, and where its text there ends."""
    if not isinstance(node, yaml.MappingNode) or node.flow_style:
        return
    for key, value in node.value:
        name, first = f"{parent}{key.value}", key.start_mark.line
        opens = value.start_mark.line != first
        mark = key.end_mark if opens else value.end_mark
        yield name, first, (mark.line, mark.column)
        yield from _keys(value, f"{name}.")


def _is_marked(lines: Sequence[str], first: int, end: tuple[int, int]) -> bool:
    line, column = end
    comments = [lines[line][column:].lstrip(" :,")] if line < len(lines) else []
    above = first - 1
    while above >= 0 and lines[above].lstrip().startswith("#"):
        comments.append(lines[above].lstrip())
        above -= 1
    return any(_MISSING.match(comment) for comment in comments)


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
