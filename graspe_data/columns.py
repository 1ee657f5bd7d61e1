"""What a column of the dataset is."""

from __future__ import annotations

from typing import Literal

import numpy as np

from graspe_data.manifest import Settings

Codec = Literal["raw", "packed_bits", "png", "jpeg"]


class Column(Settings):
    """One named array with a row per anchor, as declared in ``dataset.json``.

    ``shape`` is that of one decoded row. With codec ``packed_bits`` the last axis is stored eight
    pixels a byte, most significant first (``numpy.packbits``); ``png`` and ``jpeg`` rows are
    stored as byte strings.
    """

    name: str
    dtype: str
    shape: tuple[int, ...]
    unit: str
    frame: str
    meaning: str
    stage: str
    codec: Codec = "raw"

    @property
    def stored_shape(self) -> tuple[int, ...]:
        """The shape of one row as it lies on disk, for codecs of a fixed size."""
        if self.codec == "packed_bits":
            return (*self.shape[:-1], (self.shape[-1] + 7) // 8)
        return self.shape

    @property
    def row_bytes(self) -> int:
        """Bytes of one stored row, for codecs of a fixed size."""
        return int(np.prod(self.stored_shape, dtype=np.int64)) * np.dtype(self.dtype).itemsize
