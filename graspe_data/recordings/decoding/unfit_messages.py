"""Messages that a recording defines in its own way, without the fields that their type has."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from graspe_data.errors import RecordingError

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
