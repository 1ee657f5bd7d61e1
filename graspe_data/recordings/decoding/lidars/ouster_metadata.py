"""What an Ouster lidar says of itself: beams, transforms and the layout of its packets."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.errors import RecordingError

MAXIMUM_BYTES = 1 << 22
MOST_CHANNELS, MOST_COLUMNS, MOST_PACKET_COLUMNS = 512, 8192, 512
_MM: Final = 1000.0
_TRANSFORM: Final = 16


@dataclass(frozen=True)
class OusterMetadata:
    """The metadata of one sensor; lengths in metres, angles in rad.

    ``altitude`` and ``azimuth`` are of each beam (C,), the first row the highest. ``beam_origin``
    (2,) is how far a beam starts from the axis and above the lidar's origin. ``sensor_from_lidar``
    (4, 4). ``window`` is the first and last column that is sent. ``internal_clock``: stamps count
    from when the sensor was switched on.
    """

    profile: str
    columns_per_frame: int
    columns_per_packet: int
    window: tuple[int, int]
    altitude: Floats
    azimuth: Floats
    beam_origin: Floats
    sensor_from_lidar: Floats
    internal_clock: bool

    @property
    def packets_per_frame(self) -> int:
        """How many packets a whole frame has: those that hold a column of the window."""
        first, last = (column // self.columns_per_packet for column in self.window)
        count = self.columns_per_frame // self.columns_per_packet
        return (last - first) % count + 1


def parse_metadata(text: str, where: str) -> OusterMetadata:
    """Read the JSON of the metadata topic, flat (firmware 1.x, 2.0) or in groups (later).

    Raises:
        RecordingError: It is no such JSON, lacks a key, or a number cannot be.
    """
    if len(text) > MAXIMUM_BYTES:
        raise RecordingError(f"{where}: {len(text)} characters are no metadata of a lidar.")
    try:
        return _metadata(_flat(json.loads(text)))
    except (ValueError, TypeError, LookupError, RecursionError, OverflowError) as error:
        fault = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise RecordingError(
            f"{where}: no metadata of an Ouster lidar: {fault}. Record the driver's metadata topic "
            f"with the packets, or record its PointCloud2."
        ) from error


def _flat(content: Any) -> Mapping[str, Any]:
    """The keys of all groups beside each other."""
    flat: dict[str, Any] = {}
    for name, value in dict(content).items():
        if isinstance(value, dict):
            flat.update(value)
        flat[name] = value
    return flat


def _metadata(found: Mapping[str, Any]) -> OusterMetadata:
    layout = found.get("data_format") or found["lidar_data_format"]
    columns, packed = int(layout["columns_per_frame"]), int(layout["columns_per_packet"])
    altitude = _numbers(found["beam_altitude_angles"])
    azimuth = _numbers(found["beam_azimuth_angles"])
    count = int(layout.get("pixels_per_column", len(altitude)))
    first, last = (int(value) for value in layout.get("column_window") or (0, columns - 1))
    if not 0 < len(altitude) == len(azimuth) == count <= MOST_CHANNELS:
        raise ValueError(f"{len(altitude)} altitudes, {len(azimuth)} azimuths, {count} pixels")
    if not 0 < packed <= MOST_PACKET_COLUMNS or not 0 < columns <= MOST_COLUMNS or columns % packed:
        raise ValueError(f"{columns} columns a frame and {packed} a packet")
    if not (0 <= first < columns and 0 <= last < columns):
        raise ValueError(f"a window of the columns {first} to {last} of {columns}")
    mode = found.get("timestamp_mode", "TIME_FROM_INTERNAL_OSC")
    return OusterMetadata(
        profile=str(layout.get("udp_profile_lidar") or "LEGACY"),
        columns_per_frame=columns,
        columns_per_packet=packed,
        window=(first, last),
        altitude=np.radians(altitude),
        azimuth=np.radians(azimuth),
        beam_origin=_beam_origin(found),
        sensor_from_lidar=_transform(found.get("lidar_to_sensor_transform")),
        internal_clock=mode == "TIME_FROM_INTERNAL_OSC",
    )


def _beam_origin(found: Mapping[str, Any]) -> Floats:
    """Of the transform, where firmware 2.4 and later give one; else its first number alone."""
    if found.get("beam_to_lidar_transform") is not None:
        return _transform(found["beam_to_lidar_transform"])[[0, 2], 3]
    return np.array([float(found["lidar_origin_to_beam_origin_mm"]) / _MM, 0.0])


def _transform(values: Any) -> Floats:
    if values is None:
        return np.eye(4)
    matrix = _numbers(values)
    if len(matrix) != _TRANSFORM:
        raise ValueError(f"a transform of {len(matrix)} numbers")
    matrix = matrix.reshape(4, 4)
    if not np.allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=1e-3):
        raise ValueError("a transform that is no rotation")
    matrix[:3, 3] /= _MM
    return matrix


def _numbers(values: Any) -> Floats:
    numbers = np.array([float(value) for value in values], np.float64)
    if not np.isfinite(numbers).all():
        raise ValueError("a number that is not finite")
    return numbers
