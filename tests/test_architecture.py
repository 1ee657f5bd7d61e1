"""What the docs say of the code: every place that they name is there, and rooms are those held."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
PLACES = sorted(set(re.findall(r"`([a-z_.]+:\w+)`", PAGE)))
DOTTED = sorted(
    set(re.findall(r"`((?:graspe_data|model_zoo|planners|pipelines)\.[a-z_.]+)`", PAGE))
)


def test_the_tables_are_found() -> None:
    assert len(PLACES) > 15
    assert {"(1), (2)", "(12)"} <= set(re.findall(r"^\| (\(.*?\)) \|", PAGE, re.MULTILINE))


@pytest.mark.parametrize("place", PLACES)
def test_a_place_of_the_tables_is_there(place: str) -> None:
    module, _, name = place.partition(":")
    found = getattr(importlib.import_module(module), name)
    assert found.__module__ == module
    assert found.__doc__


@pytest.mark.parametrize("name", DOTTED)
def test_a_name_in_the_text_is_there(name: str) -> None:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError:
        module, _, attribute = name.rpartition(".")
        assert hasattr(importlib.import_module(module), attribute)
