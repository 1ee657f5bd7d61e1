"""Scans of a lidar whose driver publishes one packet a message."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from graspe_data.arrays import Bytes
from graspe_data.recordings.decoding.lidars.ouster import OusterDecoder, OusterPacket
from graspe_data.sensor_data import PointCloud

_FRAME_IDS: Final = 1 << 16
# Frames: a network delivers no later. A sensor that starts again counts from zero.
_RECENT: Final = 4


@dataclass(frozen=True)
class Scan:
    """The packets of one frame, in the order of their columns.

    ``stamp_ns`` is the sensor's time of the first valid column. ``bag_time_ns`` is when its first
    packet was received. ``share`` of the packets that a whole frame has: below 1 where the
    recording begins or ends within it, or packets were lost.
    """

    stamp_ns: int
    bag_time_ns: int
    share: float
    packets: tuple[OusterPacket, ...]
    decoder: OusterDecoder

    def cloud(self) -> PointCloud:
        """Decode the packets."""
        return self.decoder.decode(self.packets, self.stamp_ns)


class ScanAssembler:
    """Joins packets to scans by the number of their frame.

    A scan is complete with the packet that fills it, else with the first one of another frame. A
    packet of the frame before, which the network delivered late, is left out and counted. A packet
    that came twice counts once. At most one frame is held.
    """

    def __init__(self, decoder: OusterDecoder) -> None:
        """Begin between two frames."""
        self._decoder = decoder
        self._packets: dict[int, OusterPacket] = {}
        self._frame: int | None = None
        self._finished: int | None = None
        self._began_ns = 0
        self.late = 0
        """Packets that came after their frame was complete."""

    def take(self, data: Bytes, bag_time_ns: int) -> Scan | None:
        """Take the next packet; gives the scan that it completes or that it shows to be over.

        Raises:
            RecordingError: The packet is damaged; the frame goes on without it.
        """
        packet = self._decoder.packet(data)
        if self._is_late(packet.frame_id):
            self.late += 1
            return None
        over = None
        if packet.frame_id != self._frame:
            over = self.rest()
            self._frame, self._began_ns = packet.frame_id, bag_time_ns
        place = int(packet.numbers[0]) // self._decoder.metadata.columns_per_packet
        self._packets[place] = packet
        if over is None and len(self._packets) >= self._decoder.metadata.packets_per_frame:
            return self.rest()
        return over

    def _is_late(self, frame_id: int) -> bool:
        """Whether a packet is of one of the last frames that are over; numbers wrap at 65536."""
        if self._finished is None or frame_id == self._frame:
            return False
        return (self._finished - frame_id) % _FRAME_IDS < _RECENT

    def rest(self) -> Scan | None:
        """Give the scan that is not complete, at the end of a recording; None where there is none.

        A frame without a valid column is no scan.
        """
        packets = tuple(self._packets[place] for place in sorted(self._packets))
        self._packets = {}
        if self._frame is not None:
            self._finished, self._frame = self._frame, None
        stamps = [int(p.stamps_ns[p.valid][0]) for p in packets if p.valid.any()]
        if not stamps:
            return None
        share = min(1.0, len(packets) / self._decoder.metadata.packets_per_frame)
        return Scan(min(stamps), self._began_ns, share, packets, self._decoder)
