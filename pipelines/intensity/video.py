"""A video file that appears whole or not at all."""

from __future__ import annotations

import secrets
from pathlib import Path
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray


class VideoFile:
    """Writes pictures of one size as MPEG-4; where OpenCV cannot, ``path`` stays None."""

    def __init__(self, path: Path, rate_hz: float) -> None:
        """Nothing is written before the first picture."""
        self.path: Path | None = None
        self._target, self._rate_hz = path, rate_hz
        self._partial = path.with_name(f".{secrets.token_hex(4)}.partial{path.suffix}")
        self._writer: cv2.VideoWriter | None = None

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture, uint8 (H, W, 3), RGB."""
        if self._writer is None:
            height, width = picture.shape[:2]
            code = cv2.VideoWriter.fourcc(*"mp4v")
            self._writer = cv2.VideoWriter(str(self._partial), code, self._rate_hz, (width, height))
        if self._writer.isOpened():
            self._writer.write(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))

    def __enter__(self) -> Self:
        """Use as a context manager."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        """Finish the file, or remove what there is of it after an error."""
        if self._writer is not None:
            self._writer.release()
        if kind is None and self._partial.is_file() and self._partial.stat().st_size:
            self._partial.replace(self._target)
            self.path = self._target
        self._partial.unlink(missing_ok=True)
