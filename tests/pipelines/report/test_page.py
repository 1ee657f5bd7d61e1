"""The page: it nests, holds the numbers, needs nothing from elsewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from graspe_data.errors import ShardError
from graspe_data.shards.dataset_index import (
    read_index,
)
from pipelines.report import write_report
from tests.pipelines.report.conftest import HOSTILE, REASON, parsed, write_dataset


def test_the_page_nests_and_holds_the_numbers_of_the_dataset(dataset: Path, report: Path) -> None:
    text = " ".join(parsed(report).texts)
    words = re.sub(r"\s+", " ", text)
    assert read_index(dataset).dataset_digest in words
    for expected in (
        "1,234",
        "damaged: cut (/t, 3 messages, 0.2 s)",
        "clock of /points moved by +2.500 s",
        "2 taken",
        "stuck not judged: no commands",
        "not a recording",
        "The split test has no rows.",
        "1 of 3 recordings were refused.",
        "110 of 120",
        "The trajectory image is empty in 12 of 12 rows of train: the arc ends before",
    ):
        assert expected in words
    assert "clock of /image" not in words


def test_names_of_strangers_stay_text(report: Path) -> None:
    page = parsed(report)
    assert "script" not in page.elements
    assert any(HOSTILE in text for text in page.texts)
    assert any(REASON in text for text in page.texts)


def test_the_page_needs_nothing_from_elsewhere(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    assert "://" not in text
    for name, value in parsed(report).attributes:
        if name in {"src", "href"}:
            assert value.startswith(("data:image/png;base64,", "#"))
    assert re.findall(r"url\((?!#)", text) == []


def test_ids_are_unique_and_references_meet_them(report: Path) -> None:
    attributes = parsed(report).attributes
    ids = [value for name, value in attributes if name == "id"]
    assert len(ids) == len(set(ids))
    assert {value[1:] for name, value in attributes if name == "href"} <= set(ids)


def test_the_same_dataset_gives_the_same_page(dataset: Path, report: Path, tmp_path: Path) -> None:
    write_report(dataset, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == report.read_bytes()


def test_without_failures_the_page_says_so(tmp_path: Path) -> None:
    folder = write_dataset(tmp_path / "d", failing=0)
    write_report(folder, tmp_path / "page.html")
    assert any("No row fails" in text for text in parsed(tmp_path / "page.html").texts)


def test_a_split_without_rows_has_no_bar(report: Path) -> None:
    text = report.read_text(encoding="utf-8")
    rows = [row for row in text.split("<tr") if "<td>test</td>" in row]
    assert "no rows" in rows[0]
    assert 'class="bar"' not in rows[0]


def test_a_folder_without_dataset_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ShardError, match="no finished dataset"):
        write_report(tmp_path, tmp_path / "page.html")
