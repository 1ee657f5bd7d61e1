"""What a message of a video topic says, whichever type carries it."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.compressed_pictures import video_codec
from graspe_data.recordings.decoding.header import refuses_unfit_messages, stamp_ns

COMPRESSED_VIDEO: Final = "foxglove_msgs/msg/CompressedVideo"
FFMPEG_PACKET: Final = "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"
VIDEO_TYPES: Final = (COMPRESSED_VIDEO, FFMPEG_PACKET)
_SECOND: Final = 1_000_000_000


class VideoMessage(NamedTuple):
    """One packet; ``codec`` is FFmpeg's name, ``pts`` is None where the type has none."""

    stamp_ns: int
    frame: str
    codec: str
    pts: int | None
    data: bytes


@refuses_unfit_messages
def read_video_message(message: Any, message_type: str, topic: str) -> VideoMessage:
    """Read a CompressedVideo, an FFMPEGPacket, or a CompressedImage whose format is a video's.

    Raises:
        RecordingError: The codec is neither H.264 nor H.265.
    """
    if message_type == COMPRESSED_VIDEO:
        stamp = int(message.timestamp.sec) * _SECOND + int(message.timestamp.nanosec)
        frame, encoding, pts = message.frame_id, message.format, None
    else:
        stamp, frame = stamp_ns(message.header), message.header.frame_id
        packet = message_type == FFMPEG_PACKET
        encoding = message.encoding if packet else message.format
        pts = int(message.pts) if packet else None
    codec = video_codec(encoding) or _encoder(encoding)
    if codec is None:
        raise RecordingError(
            f"{topic}: a video of format {str(encoding)!r} is not read; expected h264 or h265. "
            f"Convert the topic, or name another as `image` in the robot manifest."
        )
    return VideoMessage(stamp, frame, codec, pts, bytes(message.data))


def _encoder(encoding: str) -> str | None:
    """The codec where a name is that of an encoder, as older versions write: ``hevc_nvenc``."""
    name = encoding.partition(";")[0].lower()
    if "264" in name:
        return "h264"
    return "hevc" if "265" in name or "hevc" in name else None
