"""Every command that an error or a page names is there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pipelines.command_line import COMMANDS
from pipelines.lazy_commands import loaded

ROOT = Path(__file__).resolve().parents[1]
NAMED = re.compile(r"`graspe ((?:[a-z]+)(?: [a-z]+)?)")
SOURCES = [
    *(
        path
        for top in ("graspe_data", "model_zoo", "planners", "pipelines")
        for path in sorted((ROOT / top).rglob("*.py"))
    ),
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
]


def named() -> Iterator[tuple[str, str]]:
    for path in SOURCES:
        text = re.sub(r"\"\s*\n\s*f?\"", "", path.read_text(encoding="utf-8"))
        for match in NAMED.finditer(text):
            yield match[1], path.relative_to(ROOT).as_posix()


def groups() -> dict[str, set[str]]:
    """The commands of each group; none of a command that is no group."""
    found: dict[str, Any] = {name: loaded(name, entry) for name, entry in COMMANDS.items()}
    return {name: set(getattr(command, "commands", {})) for name, command in found.items()}


def test_many_are_named() -> None:
    assert len({name for name, _ in named()}) > 12


@pytest.mark.parametrize("path", sorted({path for _, path in named()}))
def test_a_command_that_is_named_is_there(path: str) -> None:
    known = groups()
    for name, where in named():
        if where != path:
            continue
        first, _, second = name.partition(" ")
        assert first in known, name
        if known[first] and second:
            assert second in known[first], name
