"""The types of arrays that many rooms share; shapes stand where they are used."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""Numbers that are computed with."""

Floats32 = NDArray[np.float32]
"""Numbers as columns and models hold them."""

Mask = NDArray[np.bool_]
"""Which are meant."""

Indices = NDArray[np.int64]
"""Places in another array."""

Stamps = NDArray[np.int64]
"""Times, ns."""

Bytes = NDArray[np.uint8]
"""Of a message or a file."""

Map = NDArray[np.float32]
"""A layer of a map, (rows, columns)."""
