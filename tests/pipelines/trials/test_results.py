"""Trials counted: rates, intervals, tables."""

from __future__ import annotations

import csv
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.errors import StageError
from pipelines.trials.results import cells, read_trials, wilson_interval
from pipelines.trials.table import render_csv, render_markdown, table_records
from pipelines.trials.trial import ControlTimes, Failure, Trial, read_trial


def trial(method: str, seed: int, *, success: bool, path_m: float = 12.0, **changes: Any) -> Trial:
    failure = Failure(kind="perception", told=(0.6, 0.0), predicted=0.8, free=False)
    content: dict[str, Any] = {
        "scenario": "lane",
        "method": method,
        "seed": seed,
        "conditions": "c",
        "driver": "d",
        "inputs": "i",
        "outcome": "success" if success else "collision",
        "failure": None if success else failure,
        "duration_s": 25.0,
        "path_m": path_m,
        "straight_m": 10.0,
        "collisions": 0 if success else 1,
        "stuck": 0,
        "stumbles": 0,
        "arcs": 10,
        "arcs_free": 8,
        "control": ControlTimes(answers=10, mean_s=0.05, median_s=0.04, p90_s=0.08),
        "safe_commands": {},
        "start": (0.0, 0.0, 0.0),
        "goal": (10.0, 0.0),
        "path_step_s": 0.2,
        "path": ((0.0, 0.0, 0.0), (10.0, 0.0, 0.0)),
    }
    return Trial.model_validate(content | changes)


def write(out: Path, *trials: Trial) -> None:
    for each in trials:
        file = out / each.scenario / each.method / f"{each.seed}.json"
        file.parent.mkdir(parents=True, exist_ok=True)
        each.write(file)


def test_the_interval_is_wilsons() -> None:
    assert wilson_interval(7, 10) == pytest.approx((0.3968, 0.8922), abs=1e-4)
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert wilson_interval(10, 10) == pytest.approx((0.7225, 1.0), abs=1e-4)


@given(st.integers(1, 500), st.data())
def test_its_ends_are_the_shares_whose_score_test_is_just_not_rejected(
    trials: int, data: st.DataObject
) -> None:
    successes = data.draw(st.integers(0, trials))
    for end in wilson_interval(successes, trials):
        distance = successes / trials - end
        assert distance**2 == pytest.approx(1.959964**2 * end * (1 - end) / trials, abs=1e-12)


def test_a_cell_counts_its_trials() -> None:
    there = [trial("a", seed, success=seed < 3, path_m=11.0 + seed) for seed in range(4)]
    (cell,) = cells(there)
    assert (cell.successes, cell.rate, cell.collisions) == (3, 0.75, 0.25)
    assert cell.normalised_length == pytest.approx(1.2)
    assert (cell.duration_s, cell.free_share) == (25.0, 0.8)
    assert cell.answer_s == (0.04, 0.08)
    assert dict(cell.outcomes) == {"success": 3, "collision": 1}
    assert dict(cell.failures) == {"perception": 1}


def test_methods_stand_in_the_order_asked_for() -> None:
    there = [trial(method, 0, success=True) for method in ("b", "a", "c")]
    assert [cell.method for cell in cells(there)] == ["a", "b", "c"]
    assert [cell.method for cell in cells(there, ["c", "a"])] == ["c", "a"]
    with pytest.raises(StageError, match="no trials of d; there are those of a, b, c"):
        cells(there, ["d"])


def test_the_csv_holds_every_number() -> None:
    table = cells([trial("a", seed, success=seed > 0) for seed in range(4)])
    (row,) = csv.DictReader(StringIO(render_csv(table)))
    assert (row["method"], row["scenario"], row["trials"]) == ("a", "lane", "4")
    assert (row["success_rate"], row["collision"], row["perception"]) == ("0.75", "1", "1")
    assert float(row["answers_per_s"]) == pytest.approx(25.0)
    assert table_records(table)[0]["normalised_length"] == pytest.approx(1.2)


def test_the_markdown_has_a_row_for_each_method() -> None:
    trials = [trial(m, s, success=s > 0) for m in ("a", "b") for s in range(4)]
    shown = render_markdown(cells(trials))
    assert "| a | 75 (30 to 95; n = 4) |" in shown
    assert "| b | 1.200 |" in shown
    assert "| a | 25.0 | 40.0 | 80.0 |" in shown
    assert "some trials are missing" not in shown


def test_the_markdown_warns_where_seeds_differ() -> None:
    uneven = [trial("a", 0, success=True), trial("b", 1, success=True)]
    assert "**Not so in lane: some trials are missing.**" in render_markdown(cells(uneven))


def test_a_method_without_a_success_has_no_length() -> None:
    table = cells([trial("a", 0, success=False)])
    assert table[0].normalised_length is None
    assert "| a |  |" in render_markdown(table)
    assert ",,," not in render_csv(table).splitlines()[0]


def test_maps_are_shown_where_there_are_some() -> None:
    shares = {"precision": 0.9, "recall": 0.6, "f_score": 0.72}
    counts = {"maps": 3, "called": 10, "right": 9, "there": 15, "found": 9, "median_ms": 4.0}
    drawn = trial("mim", 0, success=True, maps=counts | shares)
    blind = trial("mim", 1, success=True, maps=counts | dict.fromkeys(shares, None))
    table = cells([drawn, blind, trial("dwa_lab", 0, success=True)])
    shown = render_markdown(table)
    assert "| mim | 0.72 (0.90, 0.60) |" in shown
    assert "| mim | 4.0 |" in shown
    assert [record["map_f_score"] for record in table_records(table)] == [None, 0.72]
    assert "F-score" not in render_markdown(cells([trial("a", 0, success=True)]))


def test_a_file_from_before_maps_were_compared_is_read(tmp_path: Path) -> None:
    old = trial("a", 0, success=True)
    (tmp_path / "0.json").write_text(old.model_dump_json(exclude={"maps"}))
    assert read_trial(tmp_path / "0.json") == old


def test_files_are_read_back(tmp_path: Path) -> None:
    there = [trial("a", 0, success=True), trial("b", 0, success=False)]
    write(tmp_path, *there)
    assert read_trials(tmp_path) == there


def test_trials_of_other_conditions_are_not_compared(tmp_path: Path) -> None:
    write(tmp_path, trial("a", 0, success=True), trial("b", 0, success=True, conditions="d"))
    with pytest.raises(StageError, match=r"b/0\.json and .*a/0\.json were run under other"):
        read_trials(tmp_path)


def test_a_folder_without_trials_is_named(tmp_path: Path) -> None:
    with pytest.raises(StageError, match="no trials there"):
        read_trials(tmp_path)


@pytest.mark.parametrize("content", ["", "[]", '{"format": "graspe-trial-2"}', "{" * 99])
def test_a_damaged_file_is_named(content: str, tmp_path: Path) -> None:
    (tmp_path / "0.json").write_text(content)
    with pytest.raises(StageError, match=r"0\.json: no trial of `graspe navigate run`"):
        read_trial(tmp_path / "0.json")
    with pytest.raises(StageError, match="cannot be read"):
        read_trial(tmp_path / "1.json")


def test_a_trial_that_was_copied_does_not_count_twice(tmp_path: Path) -> None:
    write(tmp_path, trial("a", 1, success=True))
    twin = tmp_path / "lane" / "a" / "2.json"
    twin.write_bytes((tmp_path / "lane" / "a" / "1.json").read_bytes())
    with pytest.raises(StageError, match=r"2.json: holds the trial lane/a/1.json"):
        read_trials(tmp_path)


def test_trials_of_two_bundles_under_one_name_are_not_one_method(tmp_path: Path) -> None:
    write(tmp_path, trial("a", 1, success=True), trial("a", 2, success=True, driver="another"))
    with pytest.raises(StageError, match="another bundle or other settings of the method"):
        read_trials(tmp_path)


def test_a_method_that_is_asked_for_twice_counts_once() -> None:
    assert len(cells([trial("a", 1, success=True)], ["a", "a"])) == 1


@pytest.mark.parametrize(
    "changes",
    [
        {"failure": Failure(kind="world", told=(0.0, 0.0), predicted=None, free=False)},
        {"arcs": 3, "arcs_free": 4},
        {"straight_m": 0.0},
        {"path": ()},
        {"collisions": 10**400},
    ],
)
def test_a_trial_that_contradicts_itself(changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"a success has no failure|arcs_free is 4|1 validation"):
        trial("a", 1, success=True, **changes)
