"""The packets of Hesai's lidars: what lies where, and the published angles of each model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.recordings.decoding.lidars.angle_table import AngleTable


@dataclass(frozen=True)
class PacketLayout:
    """Where a packet's parts lie, in bytes.

    ``signature`` are the bytes 2, 3 (Pandar64) or 2, 6, 7 (others) of the header: the protocol's
    major number, the lasers and the blocks; None for the Pandar40P, which has no header. A block
    is ``lead`` bytes, an azimuth in hundredths of a degree, and a unit a channel: a distance, a
    reflectivity and, of four bytes, a confidence. From Hesai's user manuals.
    """

    model: str
    signature: tuple[int, ...] | None
    header: int
    blocks: int
    channels: int
    unit: int
    lead: int
    return_mode: int
    least: int

    @property
    def block(self) -> int:
        """Bytes of a block."""
        return self.lead + 2 + self.channels * self.unit


LAYOUTS: Final = (
    PacketLayout("Pandar40P", None, 0, 10, 40, 3, 2, 1254, 1262),
    PacketLayout("Pandar64", (64, 6), 8, 6, 64, 3, 0, 1186, 1194),
    PacketLayout("PandarQT64", (3, 64, 4), 12, 4, 64, 4, 0, 1060, 1068),
    PacketLayout("PandarXT16", (6, 16, 8), 12, 8, 16, 4, 0, 550, 564),
    PacketLayout("PandarXT32", (6, 32, 8), 12, 8, 32, 4, 0, 1062, 1076),
    PacketLayout("PandarXT32M", (6, 32, 6), 12, 6, 32, 4, 0, 802, 816),
    PacketLayout("PandarQT128", (3, 128, 2), 12, 2, 128, 4, 0, 1073, 1087),
    PacketLayout("Pandar128", (1, 128, 2), 12, 2, 128, 3, 0, 817, 831),
)
MODELS: Final = tuple(layout.model for layout in LAYOUTS)
# Models whose headers are known and whose packets are not read, by the protocol's major number.
UNREAD: Final = {4: "AT128", 7: "FT120", 5: "ET"}


def nominal_angles(model: str) -> AngleTable | None:
    """The angles that the user manual prints for every lidar of a model; None where it has none.

    A single lidar differs from them by some tenths of a degree; its own table says how.
    """
    if model == "PandarXT16":
        return _table(np.linspace(15.0, -15.0, 16), np.zeros(16))
    if model == "PandarXT32":
        return _table(np.linspace(15.0, -16.0, 32), np.zeros(32))
    if model == "PandarXT32M":
        return _table(np.linspace(19.5, 19.5 - 31 * 1.3, 32), np.zeros(32))
    if model == "Pandar40P":
        return _pandar(24, np.array([3.125, -5.208, -1.042]))
    if model == "Pandar64":
        return _pandar(48, np.array([1.042, 3.125, 5.208, -5.208, -3.125, -1.042]))
    return None


def _pandar(dense: int, offsets: Floats) -> AngleTable:
    """Sparse beams above and below, and between them dense ones whose azimuths take turns."""
    above, below = np.array([15.0, 11, 8, 5, 3, 2]), np.array([7.0, 8, 9, 10, 11, 12, 13, 14])
    middle = 2 - 8 * np.arange(1, dense + 1) / dense
    elevation = np.concatenate([above, middle, -below, np.array([-19.0, -25.0])])
    azimuth = np.full(len(elevation), -1.042)
    azimuth[len(above) : len(above) + dense] = np.tile(offsets, dense // len(offsets))
    return _table(elevation, azimuth)


def _table(elevation: Floats, azimuth: Floats) -> AngleTable:
    return AngleTable(np.radians(elevation), np.radians(azimuth))
