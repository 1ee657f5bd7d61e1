"""Rows of an SQLite file whose index or pages are damaged, one by one by their number."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from typing import Any

from graspe_data.recordings.containers.sqlite_recovery import SMALLEST_ROW
from graspe_data.recordings.messages import Loss

MAXIMUM_LEAP = 1 << 20
FROM_ID = (
    "SELECT rowid, topic_id, timestamp, data FROM messages WHERE rowid >= ? ORDER BY rowid LIMIT 1"
)

Row = tuple[Any, ...]
"""Number, topic, time, payload."""


def salvaged_rows(
    database: sqlite3.Connection, file: str, size: int, losses: list[Loss]
) -> Iterator[Row]:
    """Go by row number; where pages are broken, leap ahead, further each time."""
    expected = number = leap = 1
    for _ in range(size // SMALLEST_ROW + 1):
        row, fault = _row_from(database, number)
        if fault is not None:
            number, leap = number + leap, leap * 2
            if leap > MAXIMUM_LEAP:
                reason = f"no row from number {expected} on can be read: {fault}"
                losses.append(Loss(f"{file}: {reason}"))
                return
            continue
        if row is None:
            return
        if row[0] > expected:
            reason = f"{file}: the rows {expected} to {row[0] - 1} cannot be read"
            losses.append(Loss(reason, None, row[0] - expected))
        yield row
        expected, number, leap = row[0] + 1, row[0] + 1, 1


def _row_from(database: sqlite3.Connection, number: int) -> tuple[Row | None, str | None]:
    """The first row from a number on, None where there is none; or what is wrong."""
    try:
        row = database.execute(FROM_ID, (number,)).fetchone()
    except (sqlite3.Error, OverflowError) as error:
        return None, str(error)
    wrong = row is not None and (not isinstance(row[0], int) or row[0] < number)
    return (None, "rows are not in order") if wrong else (row, None)
