"""Which tables of an SQLite file may be read: plain ones, since reading others runs their SQL."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from graspe_data.errors import RecordingError

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
