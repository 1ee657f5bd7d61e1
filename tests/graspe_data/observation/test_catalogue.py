"""The catalogue of columns, and the table that the docs make of it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from graspe_data.observation.catalogue import BY_NAME, CATALOGUE, Entry, columns_of

DOCS = Path(__file__).resolve().parents[3] / "docs" / "dataset.md"
BEGIN, END = "<!-- generated: columns -->\n", "<!-- end -->\n"
SIZES = {"height": 24, "width": 32, "points": 9, "rays": 7, "history": 5, "horizon": 3}
FRAMES = {"base": "body", "odometry": "vision", "camera": "camera"}


def test_a_name_stands_once() -> None:
    assert len(BY_NAME) == len(CATALOGUE)


def test_every_frame_is_named() -> None:
    for column in columns_of(SIZES | {"candidates": 2}, FRAMES):
        assert bool(column.frame) == bool(BY_NAME[column.name].frame)


@pytest.mark.parametrize(
    ("sizes", "absent"),
    [
        (SIZES, {"intensity_map", "candidate_velocity", "candidate_mask"}),
        (SIZES | {"candidates": 2}, {"intensity_map"}),
    ],
)
def test_a_column_without_sizes_is_not_made(sizes: dict[str, int], absent: set[str]) -> None:
    made = {column.name for column in columns_of(sizes, FRAMES)}
    assert not absent & made
    assert {"image", "success", "recording"} <= made


@pytest.mark.parametrize("entry", CATALOGUE, ids=lambda entry: entry.name)
def test_an_entry_contradicts_nothing(entry: Entry) -> None:
    kind = np.dtype(entry.dtype).kind
    assert not entry.empty or kind == "f"
    assert not entry.padded or (entry.empty == "nan" and entry.shape[0] == "points")
    assert not entry.share or kind == "f"
    assert entry.codec == "raw" or kind == "u"
    if entry.mirror == "negate_second":
        assert entry.shape[-1] in (2, 3)
    if entry.mirror in ("flip_pixels", "flip_order"):
        assert entry.shape
    assert entry.meaning
    assert entry.meaning[-1] != "."


def test_the_table_of_the_docs_is_the_catalogue_s() -> None:
    lines = ["| column | a row | unit | frame | what it is |", "| --- | --- | --- | --- | --- |"]
    for entry in CATALOGUE:
        shape = f" ({', '.join(map(str, entry.shape))})" if entry.shape else ""
        frame = {"base": "the robot's base", "odometry": "odometry"}.get(entry.frame, entry.frame)
        lines.append(
            f"| `{entry.name}` | {entry.dtype}{shape} | {entry.unit} | {frame} | {entry.meaning} |"
        )
    text = DOCS.read_text(encoding="utf-8")
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    expected = head + BEGIN + "\n".join(lines) + "\n" + END + tail
    if os.environ.get("GRASPE_WRITE_DOCS"):
        DOCS.write_text(expected, encoding="utf-8")
    assert text == expected, f"write it anew: GRASPE_WRITE_DOCS=1 pytest {__file__}"
