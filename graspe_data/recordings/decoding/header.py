"""What all decoders share: the place of a message, its stamp, the refusal of an unfit one."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from graspe_data.errors import RecordingError

SECOND = 1_000_000_000


def stamp_ns(header: Any) -> int:
    """The stamp of a std_msgs/Header as int64 ns."""
    return int(header.stamp.sec) * SECOND + int(header.stamp.nanosec)


def place(topic: str, header: Any) -> str:
    """Name a message in an error text: its topic and header stamp."""
    seconds, nanoseconds = divmod(stamp_ns(header), SECOND)
    return f"{topic}, header stamp {seconds}.{nanoseconds:09d}"


Arguments = ParamSpec("Arguments")
Decoded = TypeVar("Decoded")


def refuses_unfit_messages(
    decoder: Callable[Arguments, Decoded],
) -> Callable[Arguments, Decoded]:
    """Make a decoder raise RecordingError for a message whose fields are not those of its type.

    A recording carries its own definitions, and a damaged one can rename or retype any field.
    """

    @wraps(decoder)
    def refusing(*arguments: Arguments.args, **named: Arguments.kwargs) -> Decoded:
        try:
            return decoder(*arguments, **named)
        except (AttributeError, TypeError, ValueError, LookupError, ArithmeticError) as error:
            raise RecordingError(
                f"the fields are not those of the message type: {error}. Its definition in the "
                f"recording is damaged or not the standard one."
            ) from error

    return refusing
