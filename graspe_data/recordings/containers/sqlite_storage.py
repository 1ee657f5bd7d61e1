"""SQLite files of rosbag2: by the time index where it is sound, else row by row."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from pathlib import Path
from urllib.parse import quote

from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.payloads import LostMessages, unpacked
from graspe_data.recordings.containers.sqlite_recovery import SMALLEST_ROW, recover
from graspe_data.recordings.containers.sqlite_tables import Row, plain_tables, salvaged_rows
from graspe_data.recordings.containers.storage import Channel
from graspe_data.recordings.containers.work_limit import WorkLimit
from graspe_data.recordings.message_types import normalise_type
from graspe_data.recordings.messages import Damage, RawMessage

MAXIMUM_BLOB = 1 << 30
SHORTEST_LIMIT = 1 << 20
STEPS_PER_CALL = 1 << 20
STEPS_PER_BYTE = 64

COUNT = "SELECT topic_id, count(*) FROM messages NOT INDEXED GROUP BY topic_id"
IN_TIME_ORDER = "SELECT timestamp, rowid FROM messages ORDER BY timestamp, rowid"
BY_ID = "SELECT topic_id, timestamp, data FROM messages WHERE rowid = ?"
DEFINITIONS = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"


class SqliteStorage:
    """One ``.db3`` file, with the log or journal that a killed recorder left beside it.

    Args:
        path: The file, decompressed.
        compressed_messages: Whether every payload is zstd; None to see by their first bytes.
    """

    def __init__(self, path: Path, *, compressed_messages: bool | None = None) -> None:
        """Open the file, and see whether its time index is sound."""
        self._path = path
        self._compressed = compressed_messages
        self.losses: list[Damage] = []
        self.channels: dict[int, Channel] = {}
        self._in_order = True
        self._cut = False
        self.first_position = 0
        self._copy = recover(path)
        try:
            file = path if self._copy is None else self._copy.path
            self._size = file.stat().st_size
            uri = f"file:{quote(str(file.resolve()))}?mode=ro&immutable=1"
            self._database = sqlite3.connect(uri, uri=True, check_same_thread=False)
        except (OSError, sqlite3.Error) as error:
            self._remove_copy()
            raise RecordingError(f"{path}: cannot be opened: {error}.") from error
        try:
            self._open_damaged_too()
            self._note_lost_tail()
        except RecordingError:
            self.close()
            raise
        except (sqlite3.Error, ValueError, TypeError, OverflowError, MemoryError) as error:
            self.close()
            raise RecordingError(
                f"{path}: no topics can be read from this SQLite file ({error}). "
                f"Its beginning is needed: copy it again from the robot."
            ) from error

    @property
    def positions(self) -> int:
        """How many positions the messages of the file take at most."""
        return self._size // SMALLEST_ROW + 1

    def _note_lost_tail(self) -> None:
        """What the recorder wrote and did not commit: its rows are numbered after the last."""
        if self._copy is None:
            return
        self.losses += self._copy.losses
        if self._copy.tail:
            newest = next(self._rows("SELECT max(rowid) FROM messages"))[0] or 0
            reason = f"{self._path.name}: {self._copy.tail}"
            self.losses.append(Damage(reason, None, self._copy.lost_rows(newest)))

    def _remove_copy(self) -> None:
        if self._copy is not None:
            self._copy.remove()

    def _open_damaged_too(self) -> None:
        """Open; a file shorter than it should be SQLite only reads when told to."""
        try:
            self._open()
        except sqlite3.DatabaseError as error:
            self.losses.append(Damage(f"{self._path.name}: {error}"))
            self._cut = True
            self._database.execute("PRAGMA writable_schema = ON")
            self._open()

    def _open(self) -> None:
        longest = min(MAXIMUM_BLOB, max(SHORTEST_LIMIT, self._size))
        self._database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, longest)
        self._database.execute("PRAGMA trusted_schema = OFF")
        self._database.text_factory = lambda raw: raw.decode(errors="replace")
        tables = plain_tables(self._path, self._rows)
        if not {"topics", "messages"} <= tables:
            raise ValueError("the tables topics and messages are missing")
        definitions = self._definitions() if "message_definitions" in tables else {}
        counts = self._counts()
        query = "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
        for number, name, kind, encoding in self._rows(query):
            message_type = normalise_type(str(kind))
            style, text = definitions.get(str(kind), ("msg", ""))
            count = counts.get(number, 0) if counts is not None else None
            self.channels[number] = Channel(
                str(name), message_type, str(encoding or "cdr"), text, style, count
            )

    def messages(self, wanted: Collection[int], losses: list[Damage]) -> Iterator[RawMessage]:
        """Yield messages in time order, or in the order of their rows where the file is broken."""
        lost = LostMessages(self._path.name, losses)
        limit = WorkLimit(self._path, self._size)
        rows = (
            self._ordered_rows(lost)
            if self._in_order
            else salvaged_rows(self._database, self._path.name, self._size, losses)
        )
        sound = self._sound(rows, lost)
        messages = self._messages(self._apart(sound, lost) if self._cut else sound, wanted)
        encodings = {channel.topic: channel.encoding for channel in self.channels.values()}
        return unpacked(messages, self._compressed, encodings, limit.spend, lost)

    def _messages(self, rows: Iterator[Row], wanted: Collection[int]) -> Iterator[RawMessage]:
        for ordinal, (number, topic_id, stamp, data) in enumerate(rows, 1):
            if topic_id in wanted:
                place = number if self._in_order else ordinal
                position = self.first_position + place
                yield RawMessage(self.channels[topic_id].topic, stamp, data, position)

    def close(self) -> None:
        """Close the database, and remove its copy."""
        self._database.close()
        self._remove_copy()

    def _rows(self, query: str, *values: object) -> Iterator[Row]:
        """Run a query that may take a time in proportion to the file, no longer."""
        calls = iter(range(2 + STEPS_PER_BYTE * self._size // STEPS_PER_CALL))
        self._database.set_progress_handler(lambda: next(calls, None) is None, STEPS_PER_CALL)
        return iter(self._database.execute(query, values))

    def _definitions(self) -> dict[str, tuple[str, str]]:
        styles = {"ros2msg": "msg", "ros2idl": "idl"}
        return {
            str(kind): (styles.get(encoding, "msg"), str(text) if encoding in styles else "")
            for kind, encoding, text in self._rows(DEFINITIONS)
        }

    def _counts(self) -> dict[int, int] | None:
        """Count rows without the index, then see whether the index agrees."""
        counts: dict[int, int] | None = None
        try:
            counts = dict(self._rows(COUNT))
            rows = sum(counts.values())
            fault = self._index_fault(rows)
        except sqlite3.Error as error:
            fault = str(error)
        if fault is not None:
            self._in_order = False
            self.losses.append(Damage(f"{self._path.name}: {fault}; read row by row"))
        return counts

    def _index_fault(self, rows: int) -> str | None:
        """What is wrong with the time index: its entries must rise, and be as many as the rows.

        Rows are numbered from 1, and none is ever removed, so a gap is a loss.
        """
        before, entries, last = (-(1 << 63), 0), 0, 0
        for entry in self._rows(IN_TIME_ORDER):
            if not all(isinstance(item, int) for item in entry) or entry <= before or entry[1] < 1:
                return "the time index is not in order"
            before, entries, last = entry, entries + 1, max(last, entry[1])
        if entries == rows == last:
            return None
        return f"the time index has {entries} of {rows} rows, the last is number {last}"

    def _ordered_rows(self, lost: LostMessages) -> Iterator[Row]:
        for _, number in self._rows(IN_TIME_ORDER):
            try:
                row = self._database.execute(BY_ID, (number,)).fetchone()
                fault = "is in the time index only"
            except sqlite3.Error as error:
                row, fault = None, str(error)
            if row is None:
                lost.add(_row(number), "index", fault)
            else:
                yield (number, *row)

    def _sound(self, rows: Iterator[Row], lost: LostMessages) -> Iterator[Row]:
        """Rows with topic, time and payload; all payloads cannot be larger than the file."""
        left = self._size + SHORTEST_LIMIT
        for row in rows:
            number, topic_id, stamp, data = row
            left -= len(data) if isinstance(data, bytes | str) else 0
            if left < 0:
                raise RecordingError(
                    f"{self._path}: {self._size} bytes claim to hold more bytes of messages: "
                    f"refused, since its rows share their pages. Leave this file out."
                )
            if topic_id in self.channels and isinstance(stamp, int) and isinstance(data, bytes):
                yield row
            else:
                lost.add(_row(number), "fields", "has no known topic, time or payload")

    def _apart(self, rows: Iterator[Row], lost: LostMessages) -> Iterator[Row]:
        """Leave out rows beside missing ones: SQLite fills what a cut took from them with zeros."""
        before, row = 0, next(rows, None)
        while row is not None:
            following = next(rows, None)
            if row[0] == before + 1 and following is not None and following[0] == row[0] + 1:
                yield row
            else:
                topic = self.channels[row[1]].topic
                reason = "lies beside missing ones, so it may be cut"
                lost.add(_row(row[0]), "beside", reason, topic)
            before, row = row[0], following


def _row(number: int) -> str:
    return f"the row {number} of messages"
