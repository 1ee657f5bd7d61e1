"""Payloads of single messages that rosbag2 compressed one by one, in any container."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from graspe_data.recordings.containers.decompression import ZSTD_MAGIC, decompress_message
from graspe_data.recordings.messages import Damage, RawMessage

CDR_BEGINNINGS = (b"\0\0\0\0", b"\0\1\0\0")


class LostMessages:
    """Losses of single messages: one entry for all of a kind, however many there are."""

    def __init__(self, file: str, losses: list[Damage]) -> None:
        """Collect the losses of one file into a list."""
        self._file = file
        self._losses = losses
        self._places: dict[tuple[str, str | None], int] = {}

    def add(self, which: str, kind: str, reason: str, topic: str | None = None) -> None:
        """Count a message; the first of its kind and topic is the one that is named."""
        place = self._places.setdefault((kind, topic), len(self._losses))
        if place == len(self._losses):
            text = f"{self._file}: {which}, the first of its kind: {reason}"
            self._losses.append(Damage(text, topic, 1))
        else:
            known = self._losses[place]
            self._losses[place] = replace(known, messages=(known.messages or 0) + 1)


def is_packed(data: bytes | memoryview, declared: bool | None, encoding: str) -> bool:
    """Whether a payload is compressed.

    Args:
        data: The payload.
        declared: What metadata.yaml says of all; None where it says nothing, so that the first
            bytes decide. They cannot be the beginning of a CDR message.
        encoding: How messages of the channel are encoded.
    """
    beginning = bytes(data[:4])
    if declared is None:
        return beginning == ZSTD_MAGIC and encoding in ("", "cdr")
    return declared and not (encoding == "cdr" and beginning in CDR_BEGINNINGS)


def unpacked(
    messages: Iterable[RawMessage],
    declared: bool | None,
    encodings: dict[str, str],
    spend: Callable[[int, int], None],
    lost: LostMessages,
) -> Iterator[RawMessage]:
    """Decompress the payloads that are compressed; one that is damaged is a loss.

    Args:
        messages: As they lie in the file.
        declared: As in `is_packed`.
        encodings: Encoding by topic.
        spend: Told of the bytes that came out.
        lost: Told of damaged ones.
    """
    for raw in messages:
        if not is_packed(raw.data, declared, encodings[raw.topic]):
            yield raw
            continue
        try:
            content = decompress_message(raw.data)
        except ValueError as error:
            lost.add(f"the message at {raw.bag_time_ns} ns", "payload", str(error), raw.topic)
            continue
        spend(len(content), 0)
        yield RawMessage(raw.topic, raw.bag_time_ns, content, raw.position)
