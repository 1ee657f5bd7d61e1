"""Clouds as the packets of the sensor that made them, for robots that record nothing else."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.habits.clouds import points_of
from graspe_data.simulation.habits.message_parts import SECOND, header, message_class, stamp_of
from graspe_data.simulation.habits.recorded import Habit, changed
from graspe_data.simulation.lidar.beams import COLUMN_S, LASER_S, RINGS

# VLP-16 user manual (63-9243): twelve blocks of a flag, an azimuth and two columns of 16 returns.
_BLOCKS: Final = 12
_COLUMNS: Final = 2 * _BLOCKS
_RETURN: Final = np.dtype([("distance", "<u2"), ("intensity", "u1")])
_BLOCK: Final = np.dtype([("flag", "<u2"), ("azimuth", "<u2"), ("returns", _RETURN, (2 * RINGS,))])
_PACKET: Final = np.dtype(
    [("blocks", _BLOCK, (_BLOCKS,)), ("time", "<u4"), ("mode", "u1"), ("product", "u1")]
)
_FLAG, _STRONGEST, _VLP16 = 0xEEFF, 0x37, 0x22
_DISTANCE_M: Final = 0.002


def velodyne_packets(topic: str) -> Habit:
    """A VLP-16's turns as ``velodyne_msgs/VelodyneScan``.

    Distances are in steps of 2 mm and azimuths of 0.01 degrees; decoders add the offsets of the
    sixteen beams, up to 11 mm, which the simulated sensor does not have.
    """

    def change(cloud: Any) -> Any:
        stamp_ns = stamp_of(cloud)
        packets = [
            message_class("velodyne_msgs/VelodynePacket")(
                stamp=header(stamp_ns + after_ns, "").stamp, data=data
            )
            for after_ns, data in _packets(points_of(cloud))
        ]
        return message_class("velodyne_msgs/VelodyneScan")(header=cloud.header, packets=packets)

    return changed(topic, change)


def _packets(points: NDArray[np.void]) -> list[tuple[int, NDArray[np.uint8]]]:
    """Time after the first firing in ns, and bytes (1206,)."""
    ring = points["ring"].astype(np.int64)
    laser = 2 * (ring % (RINGS // 2)) + ring // (RINGS // 2)
    column = np.rint((points["time"] - laser * LASER_S) / COLUMN_S).astype(np.int64)
    turn = _turn_rate(points)
    count = int(column.max(initial=0)) // _COLUMNS + 1
    packets = np.zeros(count, _PACKET)
    packets["mode"], packets["product"] = _STRONGEST, _VLP16
    blocks = np.zeros(count * _BLOCKS, _BLOCK)
    begun = 2 * COLUMN_S * np.arange(len(blocks))
    blocks["flag"] = _FLAG
    blocks["azimuth"] = np.rint(18_000 + turn * begun * 36_000) % 36_000
    packets["time"] = np.rint(begun[::_BLOCKS] * 1e6)
    slot = laser + RINGS * (column % 2)
    blocks["returns"]["distance"][column // 2, slot] = np.rint(_ranges(points) / _DISTANCE_M)
    blocks["returns"]["intensity"][column // 2, slot] = points["intensity"]
    packets["blocks"] = blocks.reshape(count, _BLOCKS)
    whole = packets.view(np.uint8).reshape(count, -1)
    after = np.rint(begun[::_BLOCKS] * SECOND).astype(np.int64)
    return [(int(ns), data.copy()) for ns, data in zip(after, whole, strict=True)]


def _turn_rate(points: NDArray[np.void]) -> float:
    """Turns in a second, by the points of the turn's middle; clockwise from behind."""
    turned = (np.pi - np.arctan2(points["y"], points["x"])) / (2 * np.pi)
    middle = (turned > 0.1) & (turned < 0.9) & (points["time"] > 0)  # noqa: PLR2004
    share = turned[middle].astype(np.float64) / points["time"][middle].astype(np.float64)
    return float(np.median(share)) if share.size else 10.0


def _ranges(points: NDArray[np.void]) -> NDArray[np.float64]:
    xyz = np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)
    return np.asarray(np.linalg.norm(xyz, axis=1), np.float64)
