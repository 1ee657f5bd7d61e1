"""The tables of an sqlite3 file of rosbag2: found, and read as far as they are sound."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.sqlite_recovery import SMALLEST_ROW
from graspe_data.recordings.messages import Damage

SCHEMA = "SELECT name, type, rootpage, sql FROM sqlite_master"
COLUMNS = "SELECT name, hidden FROM pragma_table_xinfo(?)"
READ = ("topics", "messages", "message_definitions")
ROW_NUMBERS = ("rowid", "oid", "_rowid_")


def plain_tables(path: Path, query: Callable[..., Iterator[tuple[Any, ...]]]) -> set[str]:
    """The tables that rosbag2 has, of those in the file.

    Args:
        path: The file.
        query: Runs a query with its values.

    Raises:
        RecordingError: One of them is a view or a virtual table, or has a generated column:
            what it holds is computed while it is read, at whatever cost.
    """
    found = set()
    for name, kind, root, sql in query(SCHEMA):
        if name not in READ or kind not in ("table", "view"):
            continue
        if kind == "view" or not root or str(sql).lstrip()[:14].upper() == "CREATE VIRTUAL":
            raise _refused(path, f"{name} is a view or a virtual table")
        found.add(str(name))
    for name in sorted(found):
        for column, hidden in query(COLUMNS, name):
            if hidden:
                raise _refused(path, f"the column {column} of {name} is generated")
            if str(column).lower() in ROW_NUMBERS:
                raise _refused(path, f"the column {column} of {name} hides the row's number")
    return found


def _refused(path: Path, reason: str) -> RecordingError:
    return RecordingError(
        f"{path}: {reason}; rosbag2 writes plain tables with plain columns, and only such are "
        f"read. Leave this file out."
    )


MAXIMUM_LEAP = 1 << 20
FROM_ID = (
    "SELECT rowid, topic_id, timestamp, data FROM messages WHERE rowid >= ? ORDER BY rowid LIMIT 1"
)

Row = tuple[Any, ...]
"""Number, topic, time, payload."""


def salvaged_rows(
    database: sqlite3.Connection, file: str, size: int, losses: list[Damage]
) -> Iterator[Row]:
    """Go by row number; where pages are broken, leap ahead, further each time."""
    expected = number = leap = 1
    for _ in range(size // SMALLEST_ROW + 1):
        row, fault = _row_from(database, number)
        if fault is not None:
            number, leap = number + leap, leap * 2
            if leap > MAXIMUM_LEAP:
                reason = f"no row from number {expected} on can be read: {fault}"
                losses.append(Damage(f"{file}: {reason}"))
                return
            continue
        if row is None:
            return
        if row[0] > expected:
            reason = f"{file}: the rows {expected} to {row[0] - 1} cannot be read"
            losses.append(Damage(reason, None, row[0] - expected))
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
