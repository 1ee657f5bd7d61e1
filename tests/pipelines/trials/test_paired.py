"""Two methods on the same seeds: McNemar's exact test, and its place in the tables."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from pipelines.trials.paired import PairedTrials, pair_trials
from pipelines.trials.results import TrialGroup, cells
from pipelines.trials.table import render_markdown, table_records
from tests.pipelines.trials.test_results import trial


@given(st.integers(0, 40), st.integers(0, 40))
def test_p_is_that_of_the_binomial_test_of_scipy(won: int, lost: int) -> None:
    found = PairedTrials(100, won, lost).p_value
    expected = binomtest(won, won + lost).pvalue if won + lost else 1.0
    assert found == pytest.approx(expected, rel=1e-9)


def cell(method: str, outcomes: dict[int, bool], scenario: str = "lane") -> TrialGroup:
    trials = [
        trial(method, seed, success=success, scenario=scenario)
        for seed, success in outcomes.items()
    ]
    return TrialGroup(method, scenario, tuple(trials))


def test_only_worlds_that_both_drove_in_count() -> None:
    one = cell("a", {0: True, 1: True, 2: False, 3: True, 9: True})
    other = cell("b", {0: False, 1: True, 2: True, 3: False, 8: False})
    assert pair_trials([one], [other]) == PairedTrials(seeds=4, won=2, lost=1)
    assert pair_trials([other], [one]).gain == -0.25
    assert pair_trials([one], []) == PairedTrials(0, 0, 0)
    assert PairedTrials(0, 0, 0).gain is None


def test_scenarios_are_paired_apart_though_their_seeds_are_alike() -> None:
    one = [cell("a", {0: True}), cell("a", {0: False}, "pond")]
    other = [cell("b", {0: False}), cell("b", {0: True}, "pond")]
    assert pair_trials(one, other) == PairedTrials(2, 1, 1)


def test_the_table_holds_others_against_the_first() -> None:
    trials = [
        *(trial("fox", seed, success=seed % 2 == 0) for seed in range(8)),
        *(trial("ours", seed, success=True) for seed in range(8)),
    ]
    text = render_markdown(cells(trials, ()))
    assert "## Arrived where `fox` did not : did not where it arrived" in text
    assert "| ours | 4:0 (p = 0.12) | 4:0 (p = 0.12) |" in text
    alone = render_markdown(cells(trials[:8], ()))
    assert "McNemar" not in alone


def test_the_length_of_all_trials_stands_beside_that_of_successes() -> None:
    trials = [
        trial("fox", 0, success=True, path_m=12.0),
        trial("fox", 1, success=False, path_m=4.0),
    ]
    (record,) = table_records(cells(trials, ()))
    assert record["normalised_length"] == pytest.approx(1.2)
    assert record["length_of_all"] == pytest.approx(0.8)
    assert "## Normalised length of all trials" in render_markdown(cells(trials, ()))
