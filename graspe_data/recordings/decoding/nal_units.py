"""The units of an H.264 or H.265 byte stream: what a packet holds, without decoding it.

H.264 is ITU-T H.264 (tables 7-1, clauses 7.3.2 and 7.3.3), H.265 is ITU-T H.265 (table 7-1).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NamedTuple

_START: Final = re.compile(rb"\x00\x00\x01")
_H264_SLICES: Final = frozenset({1, 2, 5})
_H264_KEYS: Final = frozenset({5})
_H265_SLICES: Final = frozenset(range(32))
_H265_KEYS: Final = frozenset(range(16, 22))
_HEADER_BYTES: Final = 64


class Unit(NamedTuple):
    """A unit's type, its nal_ref_idc (H.264) and its first bytes, header included."""

    kind: int
    reference: int
    head: bytes


class Packet(NamedTuple):
    """What one packet holds; ``key``: a decoder can begin here."""

    units: tuple[Unit, ...]
    picture: bool
    key: bool


def read_packet(data: bytes, codec: str) -> Packet | None:
    """Find the units of a packet of ``h264`` or ``hevc``; None where it has no start code."""
    if _START.search(data, 0, 5) is None:
        return None
    units = tuple(_units(data, codec))
    h264 = codec == "h264"
    slices, keys = (_H264_SLICES, _H264_KEYS) if h264 else (_H265_SLICES, _H265_KEYS)
    kinds = [unit.kind for unit in units if unit.kind in slices]
    return Packet(units, bool(kinds), bool(kinds) and kinds[0] in keys)


def _units(data: bytes, codec: str) -> Iterator[Unit]:
    for found in _START.finditer(data):
        head = data[found.end() : found.end() + _HEADER_BYTES]
        if not head:
            continue
        if codec == "h264":
            yield Unit(head[0] & 0x1F, head[0] >> 5 & 3, head)
        else:
            yield Unit(head[0] >> 1 & 0x3F, 0, head)


class Bits:
    """Reads a unit's payload bit by bit, without its emulation prevention bytes."""

    def __init__(self, head: bytes) -> None:
        """Begin after the one-byte header of an H.264 unit."""
        payload = head[1:].replace(b"\x00\x00\x03", b"\x00\x00")
        self._value = int.from_bytes(payload, "big")
        self._left = 8 * len(payload)

    def take(self, count: int) -> int:
        """The next ``count`` bits, u(n); EOFError where they are not there."""
        self._left -= count
        if self._left < 0:
            raise EOFError
        return self._value >> self._left & ((1 << count) - 1)

    def golomb(self) -> int:
        """The next unsigned Exp-Golomb number, ue(v)."""
        zeros = 0
        while not self.take(1):
            zeros += 1
        return (1 << zeros) - 1 + self.take(zeros)

    def signed_golomb(self) -> int:
        """The next signed Exp-Golomb number, se(v)."""
        code = self.golomb()
        return (code + 1) // 2 if code % 2 else -(code // 2)
