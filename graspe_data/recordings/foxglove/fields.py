"""The fields of a message, checked as they are taken: absent ones have protobuf's defaults."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any

import numpy as np
from google.protobuf.message import Message
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray

Fields = Mapping[str, Any]
SECONDS, NANOSECONDS = ("sec", "seconds"), ("nsec", "nanos")
MAXIMUM_SECONDS = (1 << 31) - 1
LAST_NANOSECOND = 999_999_999


def protobuf_reader(schema: str, descriptors: bytes) -> Callable[[bytes], Fields]:
    """What turns a protobuf message into its fields, by the descriptors in the recording.

    Raises:
        Exception: The descriptors are damaged or lack the schema, as the library tells it.
    """
    record = Schema(id=1, name=schema, encoding="protobuf", data=descriptors)
    decode = DecoderFactory().decoder_for("protobuf", record)
    if decode is None:
        raise ValueError("the schema is not of protobuf")
    return lambda data: _plain(decode(data))


def read_json(data: bytes) -> Fields:
    """The fields of a JSON message; ValueError where it is no object."""
    fields = json.loads(data)
    if not isinstance(fields, dict):
        raise ValueError("the message is no JSON object")  # noqa: TRY004
    return fields


def _plain(message: Message) -> Fields:
    fields: dict[str, Any] = {}
    for description, value in message.ListFields():
        nested = description.message_type is not None
        if not nested:
            fields[description.name] = value
        elif isinstance(value, Message):
            fields[description.name] = _plain(value)
        else:
            fields[description.name] = [_plain(item) for item in value]
    return fields


def group(fields: Fields, name: str) -> Fields:
    """A message within the message."""
    value = fields.get(name) or {}
    if not isinstance(value, Mapping):
        raise ValueError(f"{name} is no object")  # noqa: TRY004
    return value


def groups(fields: Fields, name: str) -> list[Fields]:
    """Several messages within the message."""
    value = fields.get(name) or []
    if not isinstance(value, list) or not all(isinstance(item, Mapping) for item in value):
        raise ValueError(f"{name} is no list of objects")
    return value


def text(fields: Fields, name: str) -> str:
    """A string."""
    value = fields.get(name) or ""
    if not isinstance(value, str):
        raise ValueError(f"{name} is no text")  # noqa: TRY004
    return value


def number(fields: Fields, name: str, default: float = 0.0) -> float:
    """A finite number."""
    value = fields.get(name)
    value = default if value is None else value
    if not isinstance(value, int | float) or not isfinite(value):
        raise ValueError(f"{name} is no finite number")
    return float(value)


def whole(fields: Fields, name: str, most: int = (1 << 32) - 1) -> int:
    """A whole number from 0."""
    value = number(fields, name)
    if not 0 <= value <= most or value != int(value):
        raise ValueError(f"{name} is {value}, not a whole number from 0 to {most}")
    return int(value)


def numbers(fields: Fields, name: str, *counts: int) -> NDArray[np.float64]:
    """A list of numbers, float64; of one of these counts where there are any."""
    value = fields.get(name)
    found = np.array([] if value is None else list(value), np.float64)
    if found.ndim != 1 or (counts and len(found) not in counts):
        raise ValueError(f"{name} has the shape {found.shape}, expected one of {counts} numbers")
    return found


def content(fields: Fields, name: str) -> NDArray[np.uint8]:
    """Bytes, in JSON as base64."""
    value = fields.get(name) or b""
    if isinstance(value, str):
        value = base64.b64decode(value, validate=True)
    if not isinstance(value, bytes):
        raise ValueError(f"{name} is neither bytes nor base64")  # noqa: TRY004
    return np.frombuffer(value, np.uint8)


def time(fields: Fields, name: str = "timestamp") -> tuple[int, int]:
    """Seconds and nanoseconds; ValueError where the message has no stamp."""
    if name not in fields:
        raise ValueError(f"the message has no {name}")
    stamp = group(fields, name)
    seconds = next((key for key in SECONDS if key in stamp), SECONDS[0])
    nanoseconds = next((key for key in NANOSECONDS if key in stamp), NANOSECONDS[0])
    return whole(stamp, seconds, MAXIMUM_SECONDS), whole(stamp, nanoseconds, LAST_NANOSECOND)
