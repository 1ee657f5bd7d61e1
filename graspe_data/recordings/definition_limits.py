"""What a message definition may ask for: decoding a message is in proportion to its bytes."""

from __future__ import annotations

import hashlib
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Typesdict

from graspe_data.errors import RecordingError

MAXIMUM_ARRAY = 1 << 16
MAXIMUM_PARTS = 1 << 13
MAXIMUM_NESTING = 32


def check_limits(types: Typesdict, message_type: str) -> None:
    """Refuse a type whose fields, arrays unrolled and types within types, are too many.

    Raises:
        RecordingError: The type holds itself, nests too deeply, or has too many parts.
    """
    _parts(types, message_type, {}, ())


def _parts(types: Typesdict, name: str, known: dict[str, int], outer: tuple[str, ...]) -> int:
    if name in known:
        return known[name]
    if name in outer or len(outer) > MAXIMUM_NESTING:
        raise RecordingError(f"{outer[0]}: its definition holds itself or nests too deeply.")
    total = 1
    for _, field in types[name][1]:
        count, inner = 1, field
        if field[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            inner, count = field[1]  # type: ignore[assignment, unused-ignore]
            count = count if field[0] == Nodetype.ARRAY else 1
        if count > MAXIMUM_ARRAY:
            raise RecordingError(f"An array of {count} elements in a definition is refused.")
        if inner[0] == Nodetype.NAME:
            total += count * _parts(types, str(inner[1]), known, (*outer, name))
        else:
            total += count if "string" in str(inner[1][0]) else 1
        if total > MAXIMUM_PARTS:
            raise RecordingError(f"{(*outer, name)[0]}: its definition has too many fields.")
    known[name] = total
    return total


def layout_digest(types: Typesdict, message_type: str, same: str) -> bytes:
    """A digest of the fields of a type as they lie on the wire, without their names.

    ``same`` is a type that counts as one item: ROS 1 and ROS 2 headers differ in one number.
    """
    return _digest(types, message_type, same, {})


def _digest(types: Typesdict, name: str, same: str, known: dict[str, bytes]) -> bytes:
    if name == same:
        return name.encode()
    if name not in known:
        parts = [_wire(types, field, same, known) for _, field in types[name][1]]
        known[name] = hashlib.sha256(repr(parts).encode()).digest()
    return known[name]


def _wire(types: Typesdict, field: Any, same: str, known: dict[str, bytes]) -> Any:
    kind, detail = field
    if kind == Nodetype.NAME:
        return _digest(types, detail, same, known)
    if kind == Nodetype.BASE:
        return field
    return (int(kind), _wire(types, detail[0], same, known), detail[1])
