"""When the messages of a file begin and end, without reading them."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from graspe_data.recordings.containers.ends import read_ends
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import Container

CLASSES: Any = message_classes()
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
CONTAINERS: tuple[Container, ...] = ("bag", "db3", "mcap")
Part = Callable[..., Path]


def test_a_log_that_waits_beside_a_file_leaves_its_end_unknown(part: Part) -> None:
    file = part("run_0", 0, container="db3")
    assert read_ends(file).stop_ns == START + 4_900_000_000
    file.with_name("run_0.db3-wal").write_bytes(b"log")
    other = file.rename(file.with_name("run_1.db3"))
    other.with_name("run_1.db3-wal").write_bytes(b"log")
    assert read_ends(other).start_ns == START
    assert read_ends(other).stop_ns is None


@pytest.mark.parametrize("container", CONTAINERS)
def test_the_ends_are_those_of_the_messages(part: Part, container: Container) -> None:
    file = part("run_0", 2, container=container)
    ends = read_ends(file)
    assert (ends.start_ns, ends.stop_ns) == (START + 2 * SECOND, START + 6_900_000_000)
    assert ends.types == {"/words": "std_msgs/msg/String"}


@pytest.mark.parametrize(
    "content", [b"", b"SQLite format 3\0", b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n"]
)
def test_of_a_file_that_holds_nothing_no_end_is_known(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a_0.bag").write_bytes(content)
    ends = read_ends(tmp_path / "a_0.bag")
    assert (ends.start_ns, ends.stop_ns, ends.empty) == (None, None, False)


def test_a_table_that_never_ends_is_given_up(tmp_path: Path) -> None:
    path = tmp_path / "a_0.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE topics (id, name, type)")
        database.execute(
            "CREATE VIEW messages AS WITH RECURSIVE n(timestamp) AS (SELECT 1 UNION ALL SELECT "
            "timestamp + 1 FROM n) SELECT timestamp FROM n"
        )
    database.close()
    assert read_ends(path).start_ns is None
