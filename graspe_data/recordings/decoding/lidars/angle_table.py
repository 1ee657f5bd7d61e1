"""The angles of a lidar's channels: a maker's CSV, one line a channel."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.errors import RecordingError

MAXIMUM_BYTES = 1 << 20
_COLUMNS = 3
_STEEPEST = 90.0
_WIDEST = 360.0


@dataclass(frozen=True)
class AngleTable:
    """Elevation and azimuth offset of each channel (C,), rad, in the order of the channels."""

    elevation: Floats
    azimuth: Floats

    @property
    def ring(self) -> NDArray[np.int32]:
        """The ring of each channel: 0 is the lowest beam, as in the clouds of a Velodyne."""
        order = np.argsort(self.elevation, kind="stable")
        ring = np.empty(len(order), np.int32)
        ring[order] = np.arange(len(order))
        return ring


def read_angle_table(path: Path, channels: int) -> AngleTable:
    """Read ``Laser id,Elevation,Azimuth`` in degrees, as Hesai ships it.

    Args:
        path: The file; its first line may be a heading.
        channels: How many the lidar has; each must be there once, numbered from 1.

    Raises:
        RecordingError: The file cannot be read, or is no such table.
    """
    rows = _rows(path)
    numbers = [int(row[0]) for row in rows]
    if sorted(numbers) != list(range(1, channels + 1)):
        raise RecordingError(
            f"{path}: {len(rows)} channels; expected the channels 1 to {channels}, each once. Name "
            f"the angle table of this lidar under `lidar.angles`."
        )
    table = np.array(rows, np.float64)[np.argsort(numbers)]
    if not (np.abs(table[:, 1:]) <= (_STEEPEST, _WIDEST)).all():
        raise RecordingError(f"{path}: an angle that is no angle in degrees.")
    return AngleTable(np.radians(table[:, 1]), np.radians(table[:, 2]))


def _rows(path: Path) -> list[list[float]]:
    try:
        if path.stat().st_size > MAXIMUM_BYTES:
            raise RecordingError(f"{path}: larger than {MAXIMUM_BYTES} bytes, so no angle table.")
        lines = [row for row in csv.reader(path.read_text("utf-8-sig").splitlines()) if any(row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: the angle table cannot be read: {error}.") from error
    if lines and not lines[0][0].strip().isdigit():
        lines = lines[1:]
    try:
        rows = [[float(value) for value in line[:_COLUMNS]] for line in lines]
        whole = all(len(row) == _COLUMNS and row[0] == int(row[0]) for row in rows)
    except (ValueError, OverflowError):
        whole = False
    if not whole:
        raise RecordingError(
            f"{path}: no angle table; expected lines of `Laser id,Elevation,Azimuth` in degrees."
        )
    return rows
