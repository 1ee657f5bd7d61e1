"""Tables of trials: the counterparts of GrASPE's Table I and Table II."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from io import StringIO
from typing import Any

from pipelines.trials.paired import pair_trials
from pipelines.trials.results import TrialGroup

OUTCOMES = ("success", "collision", "stuck", "stalled", "left_arena", "timeout")
KINDS = ("perception", "threshold", "planner", "world")
NOTE = """\
Success: the robot came within the goal's radius without running into anything solid, being held
by something, standing still for too long, leaving the arena or running out of time; in brackets
the 95 % interval (Wilson). All methods met the same seeds: worlds, slip, odometry errors, noise.
"""


def table_records(table: Sequence[TrialGroup]) -> list[dict[str, Any]]:
    """A record for each method and scenario."""
    return [_record(cell) for cell in table]


def render_csv(table: Sequence[TrialGroup]) -> str:
    """The records as CSV; empty where there is no number."""
    records, text = table_records(table), StringIO()
    writer = csv.DictWriter(text, list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue()


def render_markdown(table: Sequence[TrialGroup]) -> str:
    """Table I (success, length, time, collisions), Table II (rate), and why trials failed."""
    parts = [
        "# Navigation\n",
        NOTE,
        *_seeds(table),
        _block("Success rate, %", table, _success),
        *_pairs(table),
        _block("Normalised length of successes", table, lambda c: _text(c.normalised_length, 3)),
        _block("Normalised length of all trials", table, lambda c: _text(c.length_of_all, 3)),
        _block("Seconds to the goal", table, lambda c: _text(c.duration_s, 1)),
        _block("Collisions a trial", table, lambda c: _text(c.collisions, 2)),
        *_maps(table),
        "## Control\n",
        _lines(("method", "answers/s", "median, ms", "90 %, ms"), _rates(table)),
        "## How trials ended, and why they failed\n",
        _lines(("method", *OUTCOMES, *KINDS), _ends(table)),
    ]
    return "\n".join(parts)


def _record(cell: TrialGroup) -> dict[str, Any]:
    low, high = cell.interval
    median, late = cell.answer_s
    precision, recall, f_score = cell.map_shares
    return {
        "method": cell.method,
        "scenario": cell.scenario,
        "trials": len(cell.trials),
        "successes": cell.successes,
        "success_rate": cell.rate,
        "low": low,
        "high": high,
        "normalised_length": cell.normalised_length,
        "length_of_all": cell.length_of_all,
        "duration_s": cell.duration_s,
        "collisions": cell.collisions,
        **{outcome: cell.outcomes[outcome] for outcome in OUTCOMES},
        **{kind: cell.failures[kind] for kind in KINDS},
        "free_share": cell.free_share,
        "answers_per_s": 1 / median if median else None,
        "answer_median_s": median,
        "answer_p90_s": late,
        "map_precision": precision,
        "map_recall": recall,
        "map_f_score": f_score,
        "map_ms": cell.map_ms,
    }


def _seeds(table: Sequence[TrialGroup]) -> list[str]:
    """A warning where methods did not meet the same seeds after all."""
    met: dict[str, set[frozenset[int]]] = {}
    for cell in table:
        met.setdefault(cell.scenario, set()).add(frozenset(trial.seed for trial in cell.trials))
    differing = sorted(scenario for scenario, seeds in met.items() if len(seeds) > 1)
    if not differing:
        return []
    return [f"**Not so in {', '.join(differing)}: some trials are missing.**\n"]


def _pairs(table: Sequence[TrialGroup]) -> list[str]:
    """The other methods against the first, on the same seeds; nothing for one method."""
    first, *others = _methods(table)
    scenarios = sorted({cell.scenario for cell in table})
    if not others:
        return []

    def paired(method: str, among: Sequence[str]) -> str:
        one, other = (
            [cell for cell in table if cell.method == name and cell.scenario in among]
            for name in (method, first)
        )
        found = pair_trials(one, other)
        return f"{found.won}:{found.lost} (p = {found.p_value:.2g})" if found.seeds else ""

    rows = [
        (method, *(paired(method, [each]) for each in scenarios), paired(method, scenarios))
        for method in others
    ]
    title = f"## Arrived where `{first}` did not : did not where it arrived, and McNemar's exact p"
    return [f"{title}\n\n" + _lines(("method", *scenarios, "all"), rows)]


def _maps(table: Sequence[TrialGroup]) -> list[str]:
    """The F-score of methods that drive by maps, and the time of a map; nothing without any."""
    drawn = [cell for cell in table if cell.map_ms is not None]
    if not drawn:
        return []
    return [
        _block("F-score of the maps' cells (precision, recall)", drawn, _map_shares),
        _block("Milliseconds a map", drawn, lambda c: _text(c.map_ms, 1)),
    ]


def _map_shares(cell: TrialGroup) -> str:
    precision, recall, f_score = (_text(share, 2) for share in cell.map_shares)
    return f"{f_score} ({precision}, {recall})"


def _block(title: str, table: Sequence[TrialGroup], show: Callable[[TrialGroup], str]) -> str:
    scenarios = sorted({cell.scenario for cell in table})
    shown = {(cell.method, cell.scenario): show(cell) for cell in table}
    rows = [
        (method, *(shown.get((method, scenario), "") for scenario in scenarios))
        for method in _methods(table)
    ]
    return f"## {title}\n\n" + _lines(("method", *scenarios), rows)


def _lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    marks = ["---"] + ["---:"] * (len(head) - 1)
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, marks, *rows))


def _rates(table: Sequence[TrialGroup]) -> list[tuple[str, ...]]:
    return [
        (
            whole.method,
            _text(1 / max(median, 1e-9), 1),
            _text(1e3 * median, 1),
            _text(1e3 * late, 1),
        )
        for whole in _wholes(table)
        for median, late in [whole.answer_s]
    ]


def _ends(table: Sequence[TrialGroup]) -> list[tuple[str, ...]]:
    return [
        (
            whole.method,
            *(str(whole.outcomes[outcome]) for outcome in OUTCOMES),
            *(str(whole.failures[kind]) for kind in KINDS),
        )
        for whole in _wholes(table)
    ]


def _wholes(table: Sequence[TrialGroup]) -> list[TrialGroup]:
    """Each method over all scenarios."""
    return [
        TrialGroup(
            method, "all", tuple(t for cell in table if cell.method == method for t in cell.trials)
        )
        for method in _methods(table)
    ]


def _methods(table: Sequence[TrialGroup]) -> list[str]:
    return list(dict.fromkeys(cell.method for cell in table))


def _success(cell: TrialGroup) -> str:
    low, high = (round(100 * end) for end in cell.interval)
    return f"{100 * cell.rate:.0f} ({low} to {high}; n = {len(cell.trials)})"


def _text(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
