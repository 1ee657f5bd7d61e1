"""Packets of Hesai lidars as point clouds."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Bytes
from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.header import place, refuses_unfit_messages, stamp_ns
from graspe_data.recordings.decoding.lidars.angle_table import AngleTable, read_angle_table
from graspe_data.recordings.decoding.lidars.hesai_models import (
    LAYOUTS,
    MODELS,
    UNREAD,
    PacketLayout,
    nominal_angles,
)
from graspe_data.sensor_data import PointCloud

HESAI_SCAN: Final = "pandar_msgs/msg/PandarScan"
HESAI_TYPES: Final = (HESAI_SCAN, "nebula_msgs/msg/NebulaPackets")

_HEADER_START: Final = b"\xee\xff"
_BLOCK_START: Final = 0xEEFF
_FULL_TURN: Final = 36_000
# Hesai user manuals: return modes by how many returns of a firing lie in successive blocks.
_RETURNS: Final = {
    **dict.fromkeys((0x33, 0x34, 0x37, 0x38), 1),
    **dict.fromkeys((0x39, 0x3A, 0x3B, 0x3C, 0x03), 2),
    0x3D: 3,
}
_UNIT_MM_40P: Final = 4


class HesaiDecoder:
    """Decodes pandar_msgs/PandarScan and nebula_msgs/NebulaPackets.

    The packets say which model they are of.

    The azimuth of a return is that of its block and its channel's offset, as the angle table has
    them, without a correction for the time of firing within a block (at most .05 degrees at
    10 Hz). Axes are the sensor's: y towards azimuth zero, x to the right of it, z up.
    """

    def __init__(self, model: str = "generic", angles: Path | None = None) -> None:
        """Take a model, or ``generic`` for whichever the packets say, and its angle table.

        Raises:
            RecordingError: A model that is not read from packets.
        """
        if model not in (*MODELS, "generic"):
            raise RecordingError(
                f"Packets of a Hesai {model!r} are not read; expected {', '.join(MODELS)} or "
                f"generic. Record the driver's PointCloud2, or correct `lidar.model`."
            )
        self._model, self._path = model, angles
        self._tables: dict[str, AngleTable] = {}
        self.notes: tuple[str, ...] = ()
        """What a user should know of the clouds: that the angles are nominal."""

    @refuses_unfit_messages
    def decode(self, message: Any, topic: str) -> PointCloud:
        """Decode a scan; the result depends on this message alone.

        ``ring`` counts from the lowest beam up, ``intensity`` is the reflectivity, 0..255. Of
        several returns of one firing those are kept whose distances differ.

        Raises:
            RecordingError: A packet is damaged, or of another model than declared; there is no
                angle table for its model.
        """
        where = place(topic, message.header)
        packets = [_payload(packet, where, k) for k, packet in enumerate(message.packets)]
        points = np.empty((0, 4), np.float32), np.empty(0, np.int32)
        if packets:
            layout = self._layout(packets, where)
            points = _points(_checked(packets, layout, where), layout, self._angles(layout, where))
        return PointCloud(
            stamp_ns=stamp_ns(message.header),
            frame=message.header.frame_id,
            xyz=points[0][:, :3].copy(),
            intensity=points[0][:, 3].copy(),
            ring=points[1],
        )

    def _layout(self, packets: list[Bytes], where: str) -> PacketLayout:
        found = {_model_of(packet): k for k, packet in reversed(list(enumerate(packets)))}
        names = ", ".join(sorted(found))
        layout = next((one for one in LAYOUTS if one.model == names), None)
        if layout is None or self._model not in (names, "generic"):
            expected = ", ".join(MODELS) if self._model == "generic" else self._model
            raise RecordingError(
                f"{where}: packets of {names}; expected {expected}. Correct `lidar.model` in the "
                f"robot manifest, or record the driver's PointCloud2."
            )
        return layout

    def _angles(self, layout: PacketLayout, where: str) -> AngleTable:
        model = layout.model
        if model not in self._tables:
            table = nominal_angles(model)
            if self._path is not None:
                table = read_angle_table(self._path, layout.channels)
            elif table is None:
                raise RecordingError(
                    f"{where}: each {model} has an angle table of its own. Name its file under "
                    f"`lidar.angles` in the robot manifest (CSV: Laser id,Elevation,Azimuth)."
                )
            else:
                note = f"the angles are the nominal ones of the {model}'s manual"
                self.notes = (f"{note}; name this lidar's own table under `lidar.angles`",)
            self._tables[model] = table
        return self._tables[model]


def _payload(packet: Any, where: str, number: int) -> Bytes:
    """The bytes of a packet: of a PandarPacket the first ``size``, which must fit."""
    data = np.asarray(packet.data, np.uint8)
    size = int(getattr(packet, "size", len(data)))
    if not 0 < size <= len(data):
        raise RecordingError(
            f"{where}: packet {number} says that it has {size} bytes; it holds {len(data)}. The "
            f"message is damaged."
        )
    return data[:size]


def _model_of(packet: Bytes) -> str:
    """The model by the header, or what is there instead of one."""
    head = packet[:8].tobytes()
    if head[:2] == b"\xff\xee":
        return "Pandar40P"
    if head[:2] != _HEADER_START or len(head) < 8:  # noqa: PLR2004
        return f"no Hesai lidar ({len(packet)} bytes that begin with {head[:2].hex()})"
    signatures = (head[2], head[3]), (head[2], head[6], head[7])
    for layout in LAYOUTS:
        if layout.signature in signatures:
            return layout.model
    named = UNREAD.get(head[2], "an unknown model")
    return f"{named} (protocol {head[2]}.{head[3]}, {head[6]} lasers, {head[7]} blocks)"


def _checked(packets: list[Bytes], layout: PacketLayout, where: str) -> Bytes:
    """The packets (P, bytes), cut to what is read of them."""
    short = next((k for k, packet in enumerate(packets) if len(packet) < layout.least), None)
    if short is not None:
        raise RecordingError(
            f"{where}: packet {short} of {len(packets)} has {len(packets[short])} bytes; a "
            f"{layout.model} sends at least {layout.least}. The message is damaged."
        )
    whole = np.stack([packet[: layout.least] for packet in packets])
    blocks = whole[:, layout.header : layout.header + layout.blocks * layout.block]
    heads = blocks.reshape(len(whole), layout.blocks, layout.block)[..., : layout.lead + 2]
    values = np.ascontiguousarray(heads).view("<u2")
    damaged = values[..., -1] >= _FULL_TURN
    if layout.lead:
        damaged |= values[..., 0] != _BLOCK_START
    returns = np.isin(whole[:, layout.return_mode], list(_RETURNS))
    unit = np.ones(len(whole), np.bool_) if layout.signature is None else _unit(whole, layout) > 0
    bad = damaged.any(axis=1) | ~returns | ~unit
    if bad.any():
        k = int(bad.argmax())
        raise RecordingError(
            f"{where}: packet {k} of {len(whole)} is damaged: return mode "
            f"{whole[k, layout.return_mode]:#04x}, azimuths {values[k, :, -1].tolist()}; expected "
            f"a mode of {', '.join(f'{mode:#04x}' for mode in sorted(_RETURNS))} and less than "
            f"{_FULL_TURN}."
        )
    return whole


def _unit(packets: Bytes, layout: PacketLayout) -> Bytes:
    """Millimetres a count of each packet."""
    return packets[:, 5 if layout.model == "Pandar64" else 9]


def _points(
    packets: Bytes, layout: PacketLayout, table: AngleTable
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Columns x, y, z, reflectivity (N, 4), and rings (N,)."""
    end = layout.header + layout.blocks * layout.block
    blocks = packets[:, layout.header : end].reshape(-1, layout.block)
    azimuth = np.ascontiguousarray(blocks[:, layout.lead : layout.lead + 2]).view("<u2")[:, 0]
    units = blocks[:, layout.lead + 2 :].reshape(len(blocks), layout.channels, layout.unit)
    counts = np.ascontiguousarray(units[..., :2]).view("<u2")[..., 0]
    modes = packets[:, layout.return_mode]
    kept = (counts > 0) & ~_repeated(counts, modes, layout)
    block, channel = np.nonzero(kept)
    millimetres = np.full(len(packets), _UNIT_MM_40P, np.uint8)
    if layout.signature is not None:
        millimetres = _unit(packets, layout)
    distance = counts[kept] * (millimetres[block // layout.blocks] / 1000.0)
    turned = np.radians(azimuth[block] / 100.0) + table.azimuth[channel]
    flat = distance * np.cos(table.elevation[channel])
    height = distance * np.sin(table.elevation[channel])
    columns = flat * np.sin(turned), flat * np.cos(turned), height, units[..., 2][kept]
    return np.stack(columns, axis=1).astype(np.float32), table.ring[channel]


def _repeated(counts: NDArray[np.uint16], modes: Bytes, layout: PacketLayout) -> NDArray[np.bool_]:
    """Whether a later return of the same firing has the same distance, (blocks, channels)."""
    repeated = np.zeros((len(modes), layout.blocks, layout.channels), np.bool_)
    by_packet = counts.reshape(repeated.shape)
    for returns in (2, 3):
        of_mode = np.isin(modes, [mode for mode, n in _RETURNS.items() if n == returns])
        usable = layout.blocks // returns * returns
        if not usable or not of_mode.any():
            continue
        firing = by_packet[of_mode, :usable].reshape(-1, returns, layout.channels)
        same = np.zeros(firing.shape, np.bool_)
        for first in range(returns):
            for later in range(first + 1, returns):
                same[:, first] |= firing[:, first] == firing[:, later]
        repeated[of_mode, :usable] = same.reshape(-1, usable, layout.channels)
    return repeated.reshape(counts.shape)
