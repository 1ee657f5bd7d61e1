"""One half of the validation rows selects, the other calibrates."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from graspe_data.arrays import Mask
from graspe_data.shards.dataset_index import RecordingEntry
from model_zoo.validation_halves import Halves, halve_validation

ROWS = 4


def entry(name: str, group: str = "", **details: Any) -> RecordingEntry:
    digest = hashlib.sha256(name.encode()).hexdigest()
    return RecordingEntry(
        name=name,
        digest=digest,
        group=group or digest[:12],
        split="validation",
        rows=ROWS,
        details=details,
    )


def halves(entries: Sequence[RecordingEntry], success: Mask | None = None) -> Halves:
    rows = ROWS * len(entries)
    if success is None:
        success = np.arange(rows) % 2 == 0
    recording = np.repeat(np.arange(len(entries)), ROWS)
    stamps = np.arange(rows) * 10
    labels = success[:, None], np.ones((rows, 1), bool)
    return halve_validation(entries, "validation", recording, stamps, *labels, horizon_ns=15)


def selected(entries: Sequence[RecordingEntry]) -> set[str]:
    """Names of the recordings whose rows select; a recording is never parted."""
    rows = halves(entries).selects.reshape(-1, ROWS)
    assert (rows.all(axis=1) == rows.any(axis=1)).all()
    return {one.name for one, selects in zip(entries, rows[:, 0], strict=True) if selects}


NAMES = [f"{letter}.bag" for letter in "abcdefgh"]


def test_each_recording_is_in_one_half_and_half_of_them_select() -> None:
    found = halves([entry(name) for name in NAMES])
    assert (found.selects ^ found.calibrates).all()
    assert len(selected([entry(name) for name in NAMES])) == 4


def test_neither_order_nor_bytes_nor_places_decide() -> None:
    entries = [entry(name) for name in NAMES]
    other = [one.model_copy(update={"digest": "ab" * 32, "group": "ab" * 6}) for one in entries]
    grouped = selected([one.model_copy(update={"group": ""}) for one in entries])
    assert selected(entries[::-1]) == selected(entries) == grouped
    assert len(selected(other)) == 4


def test_every_group_is_halved() -> None:
    entries = [entry(name, "hill" if place < 4 else "lake") for place, name in enumerate(NAMES)]
    found = selected(entries)
    assert len(found & set(NAMES[:4])) == len(found & set(NAMES[4:])) == 2


def test_recordings_of_one_drive_stay_together() -> None:
    entries = [entry("a.bag"), entry("b.bag", overlaps=["a.bag"]), entry("c.bag")]
    found = selected(entries)
    assert found in ({"a.bag", "b.bag"}, {"c.bag"})


def test_a_single_recording_is_cut_in_time() -> None:
    one = [entry("a.bag")]
    stamps, recording = np.arange(20) * 10, np.zeros(20, np.int64)
    success, judged = (np.arange(20) % 2 == 0)[:, None], np.ones((20, 1), bool)
    found = halve_validation(one, "validation", recording, stamps, success, judged, 15)
    assert found.how == "halves of one recording's time"
    assert not (found.selects & found.calibrates).any()
    # The horizon of a row that selects ends before the first row that calibrates.
    assert stamps[found.selects].max() + 15 < stamps[found.calibrates].min()


def test_recordings_that_fail_go_to_both_halves() -> None:
    entries = [entry(name) for name in NAMES]
    first = halves(entries).selects.reshape(-1, ROWS)[:, 0]
    # All failures lie in two recordings of the first half.
    failing = np.repeat(np.isin(np.arange(8), np.flatnonzero(first)[:2]), ROWS)
    found = halves(entries, ~failing | (np.arange(ROWS * 8) % 2 == 0))
    for half in (found.selects, found.calibrates):
        assert (half & failing).sum() == ROWS


def test_the_half_that_has_both_classes_selects() -> None:
    entries = [entry(name) for name in NAMES]
    alone = np.ones(ROWS * len(entries), bool)
    for row in range(0, alone.size, ROWS):
        alone[:] = True
        alone[row] = False
        assert halves(entries, alone).selects[row]


def test_where_no_half_has_both_all_rows_do_both_and_it_is_said() -> None:
    entries = [entry(name) for name in NAMES]
    found = halves(entries, np.zeros(ROWS * len(entries), bool))
    assert found.selects.all()
    assert found.calibrates.all()
    assert found.how.startswith("all rows, for no half")
