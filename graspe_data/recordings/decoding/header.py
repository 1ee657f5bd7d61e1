"""What every decoder needs of a header: its stamp as one integer, and where a fault lies."""

from __future__ import annotations

from typing import Any

SECOND = 1_000_000_000


def stamp_ns(header: Any) -> int:
    """The stamp of a std_msgs/Header as int64 ns."""
    return int(header.stamp.sec) * SECOND + int(header.stamp.nanosec)


def place(topic: str, header: Any) -> str:
    """Name a message in an error text: its topic and header stamp."""
    seconds, nanoseconds = divmod(stamp_ns(header), SECOND)
    return f"{topic}, header stamp {seconds}.{nanoseconds:09d}"
