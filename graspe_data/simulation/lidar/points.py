"""The layout of a point in a cloud."""

from __future__ import annotations

from typing import Final

import numpy as np

POINT_TYPE: Final[np.dtype[np.void]] = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring", "time"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<f4"],
        "offsets": [0, 4, 8, 12, 16, 18],
        "itemsize": 22,
    }
)
"""As the velodyne_pointcloud driver publishes it: metres in the sensor's frame, 0..255, the
ring from the lowest beam up, and seconds since the cloud's stamp."""
