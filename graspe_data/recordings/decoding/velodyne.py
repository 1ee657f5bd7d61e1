"""Packets of Velodyne lidars as point clouds."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import velodyne_decoder
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.header import place, refuses_unfit_messages, stamp_ns
from graspe_data.sensor_data import PointCloud

VELODYNE_SCAN: Final = "velodyne_msgs/msg/VelodyneScan"

# Packet layout, VLP-16 user manual (63-9243): twelve blocks of a flag, an azimuth in
# hundredths of a degree and 32 returns; then the time, the return mode and the product.
_PACKET_BYTES: Final = 1206
_BLOCKS, _BLOCK_BYTES = 12, 100
_FLAG: Final = 0xEEFF
_FULL_TURN: Final = 36_000
_PRODUCT_BYTE: Final = 1205
_PRODUCTS: Final = {0x22: "VLP-16", 0x28: "VLP-32C"}
_MODELS: Final = {
    "VLP-16": velodyne_decoder.Model.VLP16,
    "VLP-32C": velodyne_decoder.Model.VLP32C,
}
_LONGEST_RANGE_M: Final = 300.0


class VelodyneDecoder:
    """Decodes velodyne_msgs/VelodyneScan of a VLP-16 or a VLP-32C with velodyne-decoder.

    Follows the manuals: the azimuth is interpolated to each laser's firing, and the height is
    corrected for the offset of its beam. Of dual returns both are kept where they differ.
    """

    def __init__(self, model: str = "generic") -> None:
        """Take ``VLP-16``, ``VLP-32C``, or ``generic`` for whichever the packets say they are.

        Raises:
            RecordingError: A model that is not read from packets.
        """
        if model not in (*_MODELS, "generic"):
            raise RecordingError(
                f"Packets of a Velodyne {model!r} are not read; expected {', '.join(_MODELS)} or "
                f"generic. Record the driver's PointCloud2, or correct `lidar.model`."
            )
        self._model = model

    @refuses_unfit_messages
    def decode(self, message: Any, topic: str) -> PointCloud:
        """Decode a scan; the result depends on this message alone.

        ``ring`` counts from the lowest beam up, ``intensity`` is 0..255.

        Raises:
            RecordingError: A packet is damaged, or from another model than declared.
        """
        where = place(topic, message.header)
        packets = _packets(message, where)
        points = self._points(packets, where) if packets.size else None
        return PointCloud(
            stamp_ns=stamp_ns(message.header),
            frame=message.header.frame_id,
            xyz=np.empty((0, 3), np.float32) if points is None else points[:, :3].copy(),
            intensity=np.empty(0, np.float32) if points is None else points[:, 3].copy(),
            ring=np.empty(0, np.int32) if points is None else points[:, 6].astype(np.int32),
        )

    def _points(self, packets: NDArray[np.uint8], where: str) -> NDArray[np.float32]:
        """Columns x, y, z, intensity, time, column, ring, return type."""
        config = velodyne_decoder.Config(
            model=_MODELS[self._product(packets, where)], min_range=0.0, max_range=_LONGEST_RANGE_M
        )
        try:
            scan = velodyne_decoder.PacketVector(
                [velodyne_decoder.VelodynePacket(0.0, packet.tobytes()) for packet in packets]
            )
            _, points = velodyne_decoder.ScanDecoder(config).decode(scan)
        except (RuntimeError, ValueError, TypeError) as error:
            raise RecordingError(f"{where}: the packets do not decode: {error}.") from error
        return np.asarray(points, np.float32).reshape(-1, 8)

    def _product(self, packets: NDArray[np.uint8], where: str) -> str:
        codes = np.unique(packets[:, _PRODUCT_BYTE])
        found = ", ".join(_PRODUCTS.get(code, f"product {code:#04x}") for code in codes.tolist())
        if found not in _PRODUCTS.values() or self._model not in (found, "generic"):
            expected = " or ".join(_MODELS) if self._model == "generic" else self._model
            raise RecordingError(
                f"{where}: packets of {found}; expected {expected}. Correct `lidar.model` in the "
                f"robot manifest, or record the driver's PointCloud2."
            )
        return found


def _packets(message: Any, where: str) -> NDArray[np.uint8]:
    """The packets (P, 1206), checked: velodyne-decoder trusts flags and azimuths."""
    sizes = {len(packet.data) for packet in message.packets}
    if not sizes <= {_PACKET_BYTES}:
        raise RecordingError(
            f"{where}: a packet of {max(sizes - {_PACKET_BYTES})} bytes; expected {_PACKET_BYTES}. "
            f"The message is damaged, or not of a Velodyne lidar."
        )
    rows = [np.asarray(packet.data, np.uint8) for packet in message.packets]
    packets = np.stack(rows) if rows else np.empty((0, _PACKET_BYTES), np.uint8)
    blocks = packets[:, : _BLOCKS * _BLOCK_BYTES].reshape(-1, _BLOCK_BYTES)
    heads = np.ascontiguousarray(blocks[:, :4]).view("<u2")
    damaged = (heads[:, 0] != _FLAG) | (heads[:, 1] >= _FULL_TURN)
    if damaged.any():
        flag, azimuth = heads[damaged.argmax()].tolist()
        raise RecordingError(
            f"{where}: packet {damaged.argmax() // _BLOCKS} of {len(packets)} is damaged: a block "
            f"with flag {flag:#06x} and azimuth {azimuth}; expected {_FLAG:#06x} and less than "
            f"{_FULL_TURN}."
        )
    return packets
