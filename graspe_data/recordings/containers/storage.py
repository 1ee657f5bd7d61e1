"""What every container format gives to a `Recording`."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

from graspe_data.recordings.messages import Loss, RawMessage

MAXIMUM_TIME = (1 << 63) - 1


@dataclass(frozen=True)
class Channel:
    """One publisher's topic: its type and the definition of that type, empty where absent.

    ``schema`` is the name that the file gives, where its encoding is not one of ROS; the definition
    is then the schema's bytes, one character each.
    """

    topic: str
    message_type: str
    encoding: str
    definition: str = ""
    definition_format: str = "msg"
    count: int | None = None
    schema: str = ""


class Storage(Protocol):
    """One file of a recording, open for reading."""

    losses: list[Loss]
    """What was found missing on opening."""
    first_position: int
    """What the positions of its messages begin after: where those of the file before end."""

    @property
    def positions(self) -> int:
        """How many positions the messages of the file take at most."""

    @property
    def channels(self) -> Mapping[int, Channel]:
        """The channels by their number in the file."""

    def messages(self, wanted: Collection[int], losses: list[Loss]) -> Iterator[RawMessage]:
        """Yield the messages of some channels; append to ``losses`` what is found missing."""

    def close(self) -> None:
        """Close the file."""
