"""Settings given on the command line."""

from __future__ import annotations

import re

import pytest
import typer

from pipelines.commands.overrides import read_overrides


def test_dots_nest_and_values_are_yaml() -> None:
    words = ["graph.decay=5", "graph.focus=null", "encoders.picture_size=[120, 160]", "horizon=8"]
    assert read_overrides(words) == {
        "graph": {"decay": 5, "focus": None},
        "encoders": {"picture_size": [120, 160]},
        "horizon": 8,
    }
    assert read_overrides([]) == {}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["graph.decay"], "expected NAME=VALUE"),
        (["=5"], "expected NAME=VALUE"),
        (["graph..decay=5"], "expected NAME=VALUE"),
        (["graph.decay=5", "graph.decay=6"], "graph.decay is given twice"),
        (["graph=5", "graph.decay=6"], "graph is given as a value too"),
        (["graph.decay=6", "graph=5"], "graph is given twice"),
        (["graph.decay=[5"], "no YAML"),
        (["day=2026-13-01"], "no YAML"),
    ],
)
def test_what_is_no_setting_is_refused(words: list[str], message: str) -> None:
    with pytest.raises(typer.BadParameter, match=re.escape(message)):
        read_overrides(words)
