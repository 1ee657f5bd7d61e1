"""The pictures of one topic, whether each message is one or the topic is a video."""

from __future__ import annotations

from typing import Any

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.compressed_pictures import video_codec
from graspe_data.recordings.decoding.images import COMPRESSED_IMAGE, decode_image
from graspe_data.recordings.decoding.video import Outcome, VideoDecoder
from graspe_data.recordings.decoding.video_messages import VIDEO_TYPES

UNDECODED = "picture does not decode"


class PictureDecoder:
    """Takes the messages of one topic in the order of the recording."""

    def __init__(self, message_type: str, topic: str) -> None:
        """Choose by the type; a CompressedImage says by its first format whether it is a video."""
        self._type, self._topic = message_type, topic
        self._video: VideoDecoder | None = None
        self._known = message_type != COMPRESSED_IMAGE
        if message_type in VIDEO_TYPES:
            self._video = VideoDecoder(message_type, topic)
        self._taken = 0

    @property
    def needs_all(self) -> bool:
        """Whether messages that nobody wants must be taken as well; true until it is known."""
        return not self._known or self._video is not None

    def skip(self) -> None:
        """Count a message that is not taken; only where ``needs_all`` is false."""
        self._taken += 1

    def take(self, message: Any, *, wanted: bool = True) -> list[Outcome]:
        """Take the next message; give the outcomes known by now, each by its message's ordinal."""
        ordinal, self._taken = self._taken, self._taken + 1
        if not self._known:
            self._known = True
            if video_codec(str(getattr(message, "format", ""))):
                self._video = VideoDecoder(self._type, self._topic)
        if self._video is not None:
            return self._video.take(message, wanted=wanted)
        if not wanted:
            return []
        try:
            return [Outcome(ordinal, decode_image(message, self._type, self._topic))]
        except RecordingError as error:
            return [Outcome(ordinal, None, UNDECODED, str(error))]

    def lose(self, detail: str) -> list[Outcome]:
        """Take a message that cannot be read; ``detail`` says why."""
        ordinal, self._taken = self._taken, self._taken + 1
        if self._video is not None:
            return self._video.lose(detail)
        return [Outcome(ordinal, None, UNDECODED, detail)]

    def finish(self) -> list[Outcome]:
        """The outcomes that were still open after the last message."""
        return [] if self._video is None else self._video.finish()
