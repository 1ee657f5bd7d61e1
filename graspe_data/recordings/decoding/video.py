"""H.264 and H.265 topics as pictures, one message after another.

A picture of a video is made from those before it, back to a key frame. So every message is taken,
in the order of the recording; after a loss there is no picture until the next key frame, in place
of the smeared ones that a player would show.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.frame_numbers import FrameNumbers
from graspe_data.recordings.decoding.nal_units import Packet, read_packet
from graspe_data.recordings.decoding.picture_encodings import MAXIMUM_PIXELS, check_size
from graspe_data.recordings.decoding.video_messages import VideoMessage, read_video_message
from graspe_data.sensor_data import Picture

BEFORE_KEY_FRAME: Final = "video begins between key frames"
PACKET_LOST: Final = "a packet of the video was lost; no picture until the next key frame"
DAMAGED: Final = "the video is damaged; no picture until the next key frame"
NO_PICTURE: Final = "video message holds no picture"
# A decoder holds back at most the 16 pictures of its buffer (H.264 A.3.1, H.265 A.4.2).
_MOST_PENDING: Final = 64


class Outcome(NamedTuple):
    """What became of one message: a picture, or the reason why there is none.

    ``ordinal`` counts the messages that the decoder took, from 0; ``detail`` is the whole error.
    """

    ordinal: int
    picture: Picture | None
    reason: str = ""
    detail: str = ""


class VideoDecoder:
    """Decodes one topic; takes every message of it, in order.

    A picture is matched to its message by a number that the decoder carries through, so that a
    stream with B-frames, whose pictures come out late, gives each its own stamp.
    """

    def __init__(self, message_type: str, topic: str) -> None:
        """Begin before the first message; ``topic`` is named in errors."""
        self._type, self._topic = message_type, topic
        self._context: Any = None
        self._codec = ""
        self._closed, self._detail = BEFORE_KEY_FRAME, ""
        self._taken = 0
        self._pending: dict[int, tuple[VideoMessage, bool]] = {}
        self._numbers = FrameNumbers()
        self._pts: int | None = None
        self._counts = self._reorders = False

    def take(self, message: Any, *, wanted: bool = True) -> list[Outcome]:
        """Take the next message; give the outcomes that are known by now, in any order.

        Args:
            message: The message, with ROS's attributes.
            wanted: Whether its picture is to be made; messages that are not wanted have outcomes
                only where they fail.

        Raises:
            RecordingError: PyAV is not installed.
        """
        ordinal, self._taken = self._taken, self._taken + 1
        try:
            video = read_video_message(message, self._type, self._topic)
            packet = self._packet(video)
        except RecordingError as error:
            return self._lose(ordinal, str(error))
        return list(self._take(ordinal, video, packet, wanted))

    def lose(self, detail: str) -> list[Outcome]:
        """Take a message that cannot be read; ``detail`` says why."""
        ordinal, self._taken = self._taken, self._taken + 1
        return self._lose(ordinal, detail)

    def finish(self) -> list[Outcome]:
        """The outcomes that were still open after the last message."""
        return self._close(BEFORE_KEY_FRAME, "")

    def _lose(self, ordinal: int, detail: str) -> list[Outcome]:
        return [*self._close(DAMAGED, detail), Outcome(ordinal, None, DAMAGED, detail)]

    def _take(
        self, ordinal: int, video: VideoMessage, packet: Packet, wanted: bool
    ) -> Iterator[Outcome]:
        if video.codec != self._codec:
            yield from self._close(BEFORE_KEY_FRAME, "")
            self._context, self._codec = _context(video.codec), video.codec
            self._numbers, self._pts = FrameNumbers(), None
            self._counts = self._reorders = False
        lost = self._lost(video, packet)
        if not packet.picture:
            shown = self._decode(ordinal, video.data)
            yield from self._outcomes([] if isinstance(shown, str) else shown)
            yield Outcome(ordinal, None, NO_PICTURE, f"{self._place(video)}: {NO_PICTURE}.")
            return
        if lost and not packet.key and not self._closed:
            yield from self._close(PACKET_LOST, "")
        if packet.key:
            self._closed = ""
        if self._closed:
            yield self._without(ordinal, video)
            return
        self._pending[ordinal] = (video, wanted)
        frames = self._decode(ordinal, video.data)
        if isinstance(frames, str) or len(self._pending) > _MOST_PENDING:
            del self._pending[ordinal]
            detail = frames if isinstance(frames, str) else "the decoder holds all pictures back"
            yield from self._close(DAMAGED, f"{self._place(video)}: {detail}")
            yield self._without(ordinal, video)
            return
        yield from self._outcomes(frames)

    def _packet(self, video: VideoMessage) -> Packet:
        packet = read_packet(video.data, video.codec)
        if packet is None:
            raise RecordingError(
                f"{self._place(video)}: a packet of {len(video.data)} bytes without a start code "
                f"(00 00 01): only Annex B streams are read. Record with parameter sets in the "
                f"stream, or name another topic as `image`."
            )
        return packet

    def _without(self, ordinal: int, video: VideoMessage) -> Outcome:
        detail = self._detail or f"{self._place(video)}: {self._closed}."
        return Outcome(ordinal, None, self._closed, detail)

    def _place(self, video: VideoMessage) -> str:
        return f"{self._topic}, stamp {video.stamp_ns / 1e9:.9f}"

    def _lost(self, video: VideoMessage, packet: Packet) -> bool:
        """Whether a packet is missing before this one, by pts or by frame_num.

        pts tell where they count packets: by ones, and never down.
        """
        gap = False
        if video.pts is not None and self._pts is not None:
            step = video.pts - self._pts
            self._reorders |= step < 0 and not packet.key
            gap = self._counts and not self._reorders and step > 1
            self._counts |= step == 1
        self._pts = video.pts
        return (self._codec == "h264" and self._numbers.lost(packet)) or gap

    def _decode(self, ordinal: int, data: bytes | None) -> list[Any] | str:
        """The frames that come out, or the decoder's error; ``None`` drains it."""
        av = _av()
        packet = None
        if data is not None:
            packet = av.Packet(data)
            packet.pts = packet.dts = ordinal
        try:
            frames: list[Any] = self._context.decode(packet)
        except (av.error.FFmpegError, EOFError) as error:
            return str(error)
        return "pictures are missing" if any(frame.is_corrupt for frame in frames) else frames

    def _outcomes(self, frames: list[Any]) -> Iterator[Outcome]:
        for frame in frames:
            video, wanted = self._pending.pop(frame.pts, (None, False))
            if video is None or not wanted:
                continue
            try:
                check_size(frame.width, frame.height, self._place(video))
            except RecordingError as error:
                yield Outcome(frame.pts, None, DAMAGED, str(error))
                continue
            rgb = np.ascontiguousarray(frame.to_ndarray(format="rgb24"), np.uint8)
            yield Outcome(frame.pts, Picture(video.stamp_ns, video.frame, rgb))

    def _close(self, reason: str, detail: str) -> list[Outcome]:
        """Give what the decoder holds back; refuse what follows, up to a key frame."""
        outcomes: list[Outcome] = []
        if self._pending:
            frames = self._decode(0, None)
            outcomes += self._outcomes([] if isinstance(frames, str) else frames)
            for ordinal in self._pending:
                outcomes.append(Outcome(ordinal, None, NO_PICTURE))
            self._pending.clear()
        if self._context is not None:
            self._context.flush_buffers()
        self._closed, self._detail = reason, detail
        return outcomes


def _av() -> Any:
    try:
        import av  # noqa: PLC0415
    except ImportError as error:
        raise RecordingError(
            "Video needs PyAV, which is not installed. Install the extra: pip install "
            "'graspe[video]'."
        ) from error
    return av


def _context(codec: str) -> Any:
    """A decoder of one thread: more would hold pictures back."""
    context = _av().codec.CodecContext.create(codec, "r")
    context.thread_count = 1
    context.options = {"max_pixels": str(MAXIMUM_PIXELS), "err_detect": "explode"}
    return context
