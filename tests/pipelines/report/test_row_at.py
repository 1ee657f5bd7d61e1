"""A row is found by the name of its recording and a second of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from graspe_data.errors import ShardError
from graspe_data.shards.dataset_index import RecordingEntry, read_index, write_index
from pipelines.command_line import app
from pipelines.report import find_row
from tests.pipelines.report.conftest import HOSTILE, write_dataset

START_NS = -5 * 10**9
"""Rows 0.1 s apart from stamp 0 on, so that the first one is 5 s behind the recording's start."""


@pytest.fixture(scope="module")
def timed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("timed")
    return write_dataset(folder, details={"time_zero_ns": START_NS})


def picture(folder: Path, *words: object) -> Result:
    return CliRunner().invoke(app, ["dataset", "picture", str(folder), *map(str, words)])


@pytest.mark.parametrize(
    ("second", "row", "apart"),
    [(5.0, 0, 0.0), (5.52, 5, 0.02), (5.58, 6, 0.02), (4.2, 0, 0.8), (6.9, 11, 0.8)],
)
def test_the_nearest_row_is_taken(timed: Path, second: float, row: int, apart: float) -> None:
    found = find_row(timed, HOSTILE, second)
    assert (found.split, found.row, found.recording) == ("train", row, HOSTILE)
    assert found.time_s == pytest.approx(5 + row / 10)
    assert found.apart_s == pytest.approx(apart, abs=1e-9)


def test_of_two_rows_as_near_the_earlier_one_is_taken(timed: Path) -> None:
    assert [find_row(timed, HOSTILE, second).row for second in (5.25, 5.35, 5.45)] == [2, 3, 4]


@pytest.mark.parametrize("second", [3.9, 7.2, -27.5, 1e300])
def test_a_second_outside_of_the_rows_says_where_they_lie(timed: Path, second: float) -> None:
    with pytest.raises(ShardError, match=r"no row at .* 12 rows .* between 5\.0 and 6\.1 s"):
        find_row(timed, HOSTILE, second)


@pytest.mark.parametrize("second", [float("nan"), float("inf"), float("-inf")])
def test_a_second_that_is_no_moment_is_refused(timed: Path, second: float) -> None:
    with pytest.raises(ShardError, match="expected a number of seconds"):
        find_row(timed, HOSTILE, second)


@pytest.mark.parametrize("name", ["", "A", "bb", "../b", "\0", "*", "b" * 10_000])
def test_an_unknown_name_lists_those_there_are(timed: Path, name: str) -> None:
    with pytest.raises(ShardError, match=r"no recording .*It has .*b, c\."):
        find_row(timed, name, 5.0)


def test_a_recording_without_rows_says_why(timed: Path) -> None:
    with pytest.raises(ShardError, match=r"c has no rows in .*it was refused: not a recording"):
        find_row(timed, "c", 5.0)
    with pytest.raises(ShardError, match=r"no rows in validation; they may be in another split"):
        find_row(timed, HOSTILE, 5.0, "validation")
    with pytest.raises(ShardError, match=r"no split 'tset'"):
        find_row(timed, HOSTILE, 5.0, "tset")


def test_a_dataset_that_keeps_no_start_says_so(timed: Path) -> None:
    with pytest.raises(ShardError, match=r"does not keep when b begins.*Build it again"):
        find_row(timed, "b", 5.0)


def test_of_recordings_of_one_name_the_digest_decides(tmp_path: Path) -> None:
    folder = write_dataset(tmp_path, details={"time_zero_ns": START_NS})
    index = read_index(folder)
    twin = RecordingEntry(name=HOSTILE, digest="ef" * 32, group="twin")
    write_index(folder, index.model_copy(update={"recordings": [*index.recordings, twin]}))
    with pytest.raises(ShardError, match=r"2 recordings are called .*abababababab, efefefefefef"):
        find_row(folder, HOSTILE, 5.0)
    assert find_row(folder, "abab", 5.0).row == 0


def test_the_command_says_which_row_it_drew_and_how_far_away_it_is(
    timed: Path, tmp_path: Path
) -> None:
    by_time, by_number = tmp_path / "time.png", tmp_path / "number.png"
    result = picture(timed, "--at", HOSTILE, 5.52, "--out", by_time)
    assert result.exit_code == 0
    assert "nearest is train row 5 at 5.50 s, 0.02 s from 5.52 s" in result.stdout
    assert picture(timed, 5, "--out", by_number).exit_code == 0
    assert by_time.read_bytes() == by_number.read_bytes()


@pytest.mark.parametrize("words", [(), (3, "--at", "b", 5.0)])
def test_a_row_is_asked_for_in_one_way(timed: Path, tmp_path: Path, words: tuple[object]) -> None:
    result = picture(timed, *words, "--out", tmp_path / "row.png")
    assert "which row?" in str(result.exception)
    assert list(tmp_path.iterdir()) == []
