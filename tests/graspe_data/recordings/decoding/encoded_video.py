"""Short videos whose every picture says its number by its brightness."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import av
import numpy as np
import pytest

WIDTH, HEIGHT, STEP, SHADES = 64, 48, 8, 30
ENCODERS = {"h264": "libx264", "hevc": "libx265"}


class Encoded(NamedTuple):
    """A packet in decoding order; ``number`` is that of its picture."""

    number: int
    key: bool
    data: bytes


def encode(
    codec: str, count: int = 24, group: int = 8, b_frames: int = 0, **options: str
) -> list[Encoded]:
    """Encode pictures 0, 1, 2... with a key frame every ``group``."""
    name = ENCODERS[codec]
    if name not in av.codecs_available:
        pytest.skip(f"this build of PyAV has no {name}")
    context: Any = av.codec.CodecContext.create(name, "w")
    context.width, context.height, context.pix_fmt = WIDTH, HEIGHT, "yuv420p"
    context.time_base, context.framerate = Fraction(1, 30), Fraction(30)
    context.options = _options(codec, group, b_frames) | options
    frames = [picture_frame(number) for number in range(count)]
    packets = [packet for frame in [*frames, None] for packet in context.encode(frame)]
    return [Encoded(packet.pts, packet.is_keyframe, bytes(packet)) for packet in packets]


def picture_frame(number: int) -> Any:
    """A grey picture of brightness 8 x (number mod 30) with a bar that moves."""
    shade = STEP * (number % SHADES)
    rgb = np.full((HEIGHT, WIDTH, 3), shade, np.uint8)
    rgb[:8, : 2 * (number % SHADES)] = 255 - shade
    frame = av.VideoFrame.from_ndarray(rgb, format="rgb24")
    frame.pts = number
    return frame


def number_in(rgb: Any) -> float:
    """The number that a picture says; NaN of one that damage has made too low."""
    below = rgb[16:].astype(float)
    return float(below.mean() / STEP) if below.size else float("nan")


def _options(codec: str, group: int, b_frames: int) -> dict[str, str]:
    tune = {} if b_frames else {"tune": "zerolatency"}
    if codec == "h264":
        keys = {"g": str(group), "keyint_min": str(group), "sc_threshold": "0"}
        return {"preset": "ultrafast", "bf": str(b_frames), "crf": "6"} | keys | tune
    words = [f"keyint={group}", f"min-keyint={group}", f"bframes={b_frames}", "scenecut=0"]
    words += ["repeat-headers=1", "log-level=none", "pools=none", "frame-threads=1", "crf=6"]
    return {"preset": "ultrafast", "x265-params": ":".join(words)} | tune
