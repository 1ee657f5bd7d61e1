"""The layouts of Ouster's lidar packets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.lidars.ouster_metadata import OusterMetadata


@dataclass(frozen=True)
class Field:
    """A number in a channel's block: its offset, type, the bits that count and their unit."""

    offset: int
    kind: str
    mask: int
    unit: int = 1


@dataclass(frozen=True)
class Profile:
    """Bytes of the parts of a packet, and of each return its range in mm and reflectivity."""

    packet_header: int
    packet_footer: int
    column_header: int
    column_footer: int
    channel: int
    returns: tuple[tuple[Field, Field], ...]

    def packet_bytes(self, channels: int, columns: int) -> int:
        """Bytes of a whole packet."""
        return self.packet_header + columns * self.column_bytes(channels) + self.packet_footer

    def column_bytes(self, channels: int) -> int:
        """Bytes of one column."""
        return self.column_header + channels * self.channel + self.column_footer


# Ouster's firmware user manual, "lidar data packet format"; udp_profile_lidar names the layout.
_PROFILES: Final = {
    "LEGACY": Profile(0, 0, 16, 4, 12, ((Field(0, "<u4", 0xFFFFF), Field(4, "u1", 0xFF)),)),
    "RNG19_RFL8_SIG16_NIR16": Profile(
        32, 32, 12, 0, 12, ((Field(0, "<u4", 0x7FFFF), Field(4, "u1", 0xFF)),)
    ),
    "RNG19_RFL8_SIG16_NIR16_DUAL": Profile(
        32,
        32,
        12,
        0,
        16,
        (
            (Field(0, "<u4", 0x7FFFF), Field(3, "u1", 0xFF)),
            (Field(4, "<u4", 0x7FFFF), Field(7, "u1", 0xFF)),
        ),
    ),
    "RNG15_RFL8_NIR8": Profile(
        32, 32, 12, 0, 4, ((Field(0, "<u2", 0x7FFF, 8), Field(2, "u1", 0xFF)),)
    ),
}


def profile_of(metadata: OusterMetadata, where: str) -> Profile:
    """The layout that the metadata names.

    Raises:
        RecordingError: Packets of another profile are not read.
    """
    if metadata.profile not in _PROFILES:
        raise RecordingError(
            f"{where}: packets of the profile {metadata.profile!r} are not read; expected one of "
            f"{', '.join(_PROFILES)}. Record the driver's PointCloud2."
        )
    return _PROFILES[metadata.profile]
