"""Packets of Ouster lidars as point clouds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Bytes, Floats
from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.lidars.ouster_metadata import OusterMetadata
from graspe_data.recordings.decoding.lidars.ouster_profiles import Field, profile_of
from graspe_data.sensor_data import PointCloud

OUSTER_TYPES: Final = (
    "ouster_ros/msg/PacketMsg",
    "ouster_msgs/msg/PacketMsg",
    "ouster_sensor_msgs/msg/PacketMsg",
)
FRAME: Final = "os_sensor"


@dataclass(frozen=True)
class OusterPacket:
    """One packet: its columns (K, bytes) and of each its stamp, number and whether it is valid."""

    frame_id: int
    columns: Bytes
    stamps_ns: NDArray[np.uint64]
    numbers: NDArray[np.uint16]
    valid: NDArray[np.bool_]


class OusterDecoder:
    """Decodes the packets of one sensor by its metadata.

    Points are in the sensor's frame, which its driver calls ``os_sensor``: x towards the cable of
    the connector's far side, as ``lidar_to_sensor_transform`` turns them. ``ring`` is the row,
    0 the highest beam, as in the clouds of Ouster's driver. ``intensity`` is the calibrated
    reflectivity, 0..255, not the signal. Of dual returns both are kept where they differ.
    """

    def __init__(self, metadata: OusterMetadata, topic: str) -> None:
        """Prepare the direction and origin of every beam in every column.

        Raises:
            RecordingError: A profile that is not read.
        """
        self.metadata, self._topic = metadata, topic
        self._profile = profile_of(metadata, topic)
        self._bytes = self._profile.packet_bytes(
            len(metadata.altitude), metadata.columns_per_packet
        )
        self._directions, self._origins = _rays(metadata)

    def packet(self, data: Bytes) -> OusterPacket:
        """Take a packet apart.

        Raises:
            RecordingError: Its size is not that of the profile, or a column has no such number.
        """
        if len(data) != self._bytes:
            raise RecordingError(
                f"{self._topic}: a packet of {len(data)} bytes; {self.metadata.profile} with "
                f"{len(self.metadata.altitude)} channels and {self.metadata.columns_per_packet} "
                f"columns has {self._bytes}. The packet is damaged, or the metadata is of another "
                f"sensor or mode."
            )
        profile = self._profile
        body = data[profile.packet_header : len(data) - profile.packet_footer]
        columns = body.reshape(self.metadata.columns_per_packet, -1)
        head = np.ascontiguousarray(columns[:, :12])
        numbers = head[:, 8:10].copy().view("<u2")[:, 0]
        if profile.packet_header:
            frame_id = int(data[2]) | int(data[3]) << 8
            valid = (head[:, 10] & 1) == 1
        else:
            frame_id = int(head[0, 10]) | int(head[0, 11]) << 8
            valid = (columns[:, -profile.column_footer :] == 0xFF).all(axis=1)  # noqa: PLR2004
        if (numbers[valid] >= self.metadata.columns_per_frame).any():
            raise RecordingError(
                f"{self._topic}: frame {frame_id} has a column {numbers[valid].max()}; expected "
                f"less than {self.metadata.columns_per_frame}. The packet is damaged, or the "
                f"metadata is of another mode."
            )
        stamps = head[:, :8].copy().view("<u8")[:, 0]
        return OusterPacket(frame_id, columns, stamps, numbers, valid)

    def decode(self, packets: Sequence[OusterPacket], stamp_ns: int) -> PointCloud:
        """The cloud of the packets of one frame, column by column."""
        columns = np.concatenate([packet.columns[packet.valid] for packet in packets])
        numbers = np.concatenate([packet.numbers[packet.valid] for packet in packets])
        channels, profile = len(self.metadata.altitude), self._profile
        start, end = profile.column_header, profile.column_header + channels * profile.channel
        blocks = columns[:, start:end].reshape(len(columns), channels, profile.channel)
        xyz, strength, rings, before = [], [], [], None
        for range_field, reflectivity_field in profile.returns:
            millimetres = _values(blocks, range_field)
            kept = (
                millimetres > 0 if before is None else (millimetres > 0) & (millimetres != before)
            )
            before = millimetres
            column, row = np.nonzero(kept)
            xyz.append(self._placed(millimetres[kept], numbers[column], row))
            strength.append(_values(blocks, reflectivity_field)[kept].astype(np.float32))
            rings.append(row.astype(np.int32))
        return PointCloud(
            stamp_ns=stamp_ns,
            frame=FRAME,
            xyz=np.concatenate(xyz),
            intensity=np.concatenate(strength),
            ring=np.concatenate(rings),
        )

    def _placed(
        self,
        millimetres: NDArray[np.uint32],
        number: NDArray[np.uint16],
        row: NDArray[np.intp],
    ) -> NDArray[np.float32]:
        reach = millimetres / 1000.0 - np.hypot(*self.metadata.beam_origin)
        points = reach[:, None] * self._directions[number, row] + self._origins[number]
        return np.asarray(points, np.float32)


def _rays(metadata: OusterMetadata) -> tuple[Floats, Floats]:
    """Directions (columns, channels, 3) and origins (columns, 3) in the sensor's frame, metres.

    Ouster's software user manual, "lidar range data to sensor coordinates": the encoder counts
    clockwise, and a range is counted from the axis, through the beam's origin beside it.
    """
    turned = 2 * np.pi * (1 - np.arange(metadata.columns_per_frame) / metadata.columns_per_frame)
    azimuth, altitude = turned[:, None] - metadata.azimuth, metadata.altitude
    directions = np.stack(
        [
            np.cos(azimuth) * np.cos(altitude),
            np.sin(azimuth) * np.cos(altitude),
            np.broadcast_to(np.sin(altitude), azimuth.shape),
        ],
        axis=-1,
    )
    aside, above = metadata.beam_origin
    origins = np.stack(
        [aside * np.cos(turned), aside * np.sin(turned), np.full(len(turned), above)], axis=-1
    )
    rotation, offset = metadata.sensor_from_lidar[:3, :3], metadata.sensor_from_lidar[:3, 3]
    return directions @ rotation.T, origins @ rotation.T + offset


def _values(blocks: Bytes, field: Field) -> NDArray[np.uint32]:
    size = np.dtype(field.kind).itemsize
    raw = np.ascontiguousarray(blocks[..., field.offset : field.offset + size])
    found = raw.view(field.kind)[..., 0].astype(np.uint32)
    return (found & np.uint32(field.mask)) * np.uint32(field.unit)
