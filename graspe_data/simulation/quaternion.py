"""Quaternions (x, y, z, w) of rotations."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats


def quaternion_from_rotation(rotation: Floats) -> Floats:
    """The unit quaternion (4,) with w >= 0 of a rotation matrix (3, 3).

    Shepperd (1978): the matrix of products 4 q_i q_j is linear in the rotation; its row with the
    largest diagonal is q, but for its length and sign.
    """
    m = rotation
    x, y, z = np.diag(m)
    products = np.array(
        [
            [1 + x - y - z, m[1, 0] + m[0, 1], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
            [m[1, 0] + m[0, 1], 1 - x + y - z, m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
            [m[0, 2] + m[2, 0], m[2, 1] + m[1, 2], 1 - x - y + z, m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1 + x + y + z],
        ]
    )
    row = products[np.argmax(np.diag(products))]
    unit: Floats = row / np.copysign(np.linalg.norm(row), row[3])
    return unit
