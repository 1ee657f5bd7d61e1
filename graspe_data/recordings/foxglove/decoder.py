"""What decodes a channel of Foxglove's messages, or says why nothing does."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Literal

from graspe_data.errors import RecordingError
from graspe_data.recordings.foxglove.fields import Fields, protobuf_reader, read_json, time
from graspe_data.recordings.foxglove.messages import KINDS, frame_transform, frame_transforms

ENCODINGS: tuple[Literal["json", "protobuf"], ...] = ("json", "protobuf")
MAXIMUM_DESCRIPTORS = 1 << 18


class FoxgloveDecoder:
    """Decodes messages of one schema.

    Args:
        schema: Its name, ``foxglove.PointCloud`` or another.
        encoding: ``json`` or ``protobuf``.
        definition: The schema's own bytes, one character each.

    Raises:
        RecordingError: The kind is not one that is read, or its descriptors are damaged.
    """

    def __init__(self, schema: str, encoding: str, definition: str) -> None:
        """Find the kind, and parse the descriptors."""
        if schema not in KINDS:
            raise RecordingError(
                f"messages encoded as {encoding!r} of the schema {schema[:80]!r}; of this encoding "
                f"{', '.join(KINDS)} are read."
            )
        self._convert = KINDS[schema][1]
        self._read = _reader(schema, encoding, definition)

    def decode(self, data: bytes) -> Any:
        """Decode to an object with the attributes of the ROS type.

        Raises:
            Exception: The message does not fit the schema.
        """
        return self._convert(self._read(data))

    def stamp_ns(self, data: bytes) -> int | None:
        """The stamp of the message; None for transforms, each of which has its own.

        Raises:
            Exception: The message does not fit the schema.
        """
        if self._convert in (frame_transform, frame_transforms):
            return None
        seconds, nanoseconds = time(self._read(data))
        return seconds * 1_000_000_000 + nanoseconds


@functools.lru_cache(maxsize=64)
def _reader(schema: str, encoding: str, definition: str) -> Callable[[bytes], Fields]:
    if encoding == "json":
        return read_json
    if len(definition) > MAXIMUM_DESCRIPTORS:
        raise RecordingError(f"{schema}: its descriptors have {len(definition)} bytes: refused.")
    try:
        return protobuf_reader(schema, definition.encode("latin-1"))
    except Exception as error:
        raise RecordingError(
            f"{schema}: the protobuf descriptors in the recording are damaged: {error}. "
            f"Record again."
        ) from error
