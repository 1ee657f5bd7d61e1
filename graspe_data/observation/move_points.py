"""Points carried from one frame into another, the same to the bit on every processor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform


def move_points(xyz: NDArray[np.float32], transform: Transform) -> NDArray[np.float32]:
    """Carry points (N, 3) over by sums and products alone, which every processor rounds alike."""
    x, y, z = np.ascontiguousarray(xyz.T)
    moved = np.empty((3, len(xyz)), np.float32)
    rows = np.column_stack((transform.rotation, transform.translation)).astype(np.float32)
    for axis, (a, b, c, shift) in enumerate(rows):
        np.multiply(a, x, out=moved[axis])
        moved[axis] += b * y
        moved[axis] += c * z
        moved[axis] += shift
    return moved.T
