"""How large a picture may be before memory is taken for it."""

from __future__ import annotations

from graspe_data.errors import RecordingError

MAXIMUM_SIDE = 16_384
MAXIMUM_PIXELS = 1 << 26


def check_size(width: int, height: int, where: str) -> None:
    """Refuse a picture that is empty or too large.

    Raises:
        RecordingError: A side is outside 1..16384 pixels, or there are more than 2^26 pixels.
    """
    sides_fit = 1 <= width <= MAXIMUM_SIDE and 1 <= height <= MAXIMUM_SIDE
    if not sides_fit or width * height > MAXIMUM_PIXELS:
        raise RecordingError(
            f"{where}: a picture of {width}x{height} pixels; expected sides of 1 to {MAXIMUM_SIDE} "
            f"and at most {MAXIMUM_PIXELS} pixels. The message is damaged, or no camera's."
        )
