"""Whether a picture that others refer to is missing from an H.264 stream, by ``frame_num``.

The decoder conceals such a loss by repeating another picture, and says nothing. Every reference
picture counts ``frame_num`` up by one, so the number of the next tells (ITU-T H.264, 7.4.3). In
H.265 the decoder itself reports a missing reference.
"""

from __future__ import annotations

from typing import Final

from graspe_data.recordings.decoding.nal_units import Bits, Packet, Unit

_SEQUENCE, _PARAMETERS, _KEY_SLICE, _SLICE = 7, 8, 5, 1
# Profiles whose sequence parameters give the chroma format, 7.3.2.1.1.
_HIGH: Final = frozenset({100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135})
_SEPARATE_PLANES: Final = 3
_LISTS: Final = 8


class FrameNumbers:
    """Follows ``frame_num`` through the packets of one stream."""

    def __init__(self) -> None:
        """Begin before any parameters were seen."""
        self._widths: dict[int, int] = {}
        self._sequence_of: dict[int, int] = {}
        self._last: int | None = None

    def lost(self, packet: Packet) -> bool:
        """Take a packet; tell whether a picture that it refers to was never seen.

        False where the stream allows gaps, or does not tell.
        """
        for unit in packet.units:
            try:
                if unit.kind == _SEQUENCE:
                    self._take_sequence(unit)
                elif unit.kind == _PARAMETERS:
                    bits = Bits(unit.head)
                    self._sequence_of[bits.golomb()] = bits.golomb()
                elif unit.kind in (_SLICE, _KEY_SLICE):
                    return self._take_slice(unit)
            except EOFError:
                continue
        return False

    def _take_slice(self, unit: Unit) -> bool:
        bits = Bits(unit.head)
        bits.golomb()
        bits.golomb()
        width = self._widths.get(self._sequence_of.get(bits.golomb(), -1))
        if width is None:
            return False
        number, last = bits.take(width), self._last
        if unit.reference or unit.kind == _KEY_SLICE:
            self._last = number
        if unit.kind == _KEY_SLICE or last is None:
            return False
        return number not in (last, (last + 1) % (1 << width))

    def _take_sequence(self, unit: Unit) -> None:
        bits = Bits(unit.head)
        profile = bits.take(8)
        bits.take(16)
        identifier = bits.golomb()
        if profile in _HIGH:
            _skip_chroma(bits)
        width = bits.golomb() + 4
        order = bits.golomb()
        if order == 0:
            bits.golomb()
        elif order == 1:
            bits.take(1)
            bits.signed_golomb()
            bits.signed_golomb()
            for _ in range(min(bits.golomb(), 255)):
                bits.signed_golomb()
        bits.golomb()
        allowed = bits.take(1)
        self._widths.pop(identifier, None)
        if not allowed:
            self._widths[identifier] = width


def _skip_chroma(bits: Bits) -> None:
    """Skip chroma format, bit depths and scaling lists; EOFError for the rare 4:4:4."""
    if bits.golomb() == _SEPARATE_PLANES:
        raise EOFError
    bits.golomb()
    bits.golomb()
    bits.take(1)
    if not bits.take(1):
        return
    for index in range(_LISTS):
        if not bits.take(1):
            continue
        last = following = 8
        for _ in range(16 if index < 6 else 64):  # noqa: PLR2004
            if following:
                following = (last + bits.signed_golomb()) % 256
            last = following or last
