"""Raw messages to objects with the attributes of their ROS types, and stamps without decoding."""

from __future__ import annotations

from struct import Struct

from rosbags.typesys.store import Typestore

from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.storage import Channel
from graspe_data.recordings.foxglove.decoder import ENCODINGS, FoxgloveDecoder
from graspe_data.recordings.message_types import first_stamp, resolve_type, wire_layout

# ROS 1: seq u32, sec u32, nsec u32. CDR: four bytes of encapsulation, sec i32, nsec u32.
ROS1_LAYOUTS = {"header": Struct("<4xII"), "timestamp": Struct("<II")}
CDR_STAMP = {0: Struct(">4xiI"), 1: Struct("<4xiI")}


class MessageDecoder:
    """Decodes the messages of one channel.

    Its definition is parsed here; where that fails, messages cannot be decoded but still be read.
    """

    def __init__(self, channel: Channel) -> None:
        """Build the decoder by the channel's definition, or by the standard one."""
        self._channel = channel
        self._store: Typestore | None = None
        self._fault = self.note = ""
        self._foxglove: FoxgloveDecoder | None = None
        if channel.encoding in ENCODINGS:
            self._open_foxglove()
            return
        if channel.encoding not in ("ros1", "cdr"):
            self._fault = (
                f"messages encoded as {channel.encoding!r}; only ros1, cdr and Foxglove's json "
                f"and protobuf are decoded. Convert the recording."
            )
            return
        self._store, self._fault, self.note = resolve_type(
            channel.message_type, channel.encoding, channel.definition, channel.definition_format
        )
        if self._store is not None:
            self._stamped = first_stamp(self._store, channel.message_type)

    def _open_foxglove(self) -> None:
        channel = self._channel
        try:
            self._foxglove = FoxgloveDecoder(channel.schema, channel.encoding, channel.definition)
        except RecordingError as error:
            self._fault = str(error)

    def decode(self, data: bytes | memoryview) -> object:
        """Decode a message; trailing bytes are ignored.

        Raises:
            RecordingError: There is no definition, or the message does not fit it.
        """
        if self._fault:
            raise RecordingError(self._fault)
        try:
            if self._store is not None:
                return self._deserialise(self._store, data)
            return None if self._foxglove is None else self._foxglove.decode(bytes(data))
        except Exception as error:
            raise RecordingError(
                f"{len(data)} bytes are no {self._channel.message_type} "
                f"({str(error) or type(error).__name__}). Leave the message out; where all of the "
                f"topic fail, its definition in the recording is wrong."
            ) from error

    def header_stamp_ns(self, data: bytes | memoryview) -> int | None:
        """The stamp of the header by its place in the bytes; None where there is no header.

        A stamp that stands where a header would, as in foxglove_msgs, counts as one.
        """
        if self._foxglove is not None:
            try:
                return self._foxglove.stamp_ns(bytes(data))
            except Exception:  # noqa: BLE001 - damaged in whatever way; decoding names it
                return None
        if self._store is None or self._stamped == "":
            return None
        ros1 = self._channel.encoding == "ros1"
        layout = ROS1_LAYOUTS[self._stamped] if ros1 else CDR_STAMP.get(_byte_order(data))
        if layout is None or len(data) < layout.size:
            return None
        seconds, nanoseconds = layout.unpack_from(data)
        return int(seconds) * 1_000_000_000 + int(nanoseconds)

    def reads_alike(self, other: MessageDecoder) -> bool:
        """Whether both decode the same bytes to the same fields, as tf and tf2 messages do."""
        if self._channel.encoding != other._channel.encoding:
            return False
        if self._channel.schema or other._channel.schema:
            return self._channel.schema == other._channel.schema
        if self._channel.message_type == other._channel.message_type:
            return True
        if self._store is None or other._store is None:
            return False
        ours = wire_layout(self._store, self._channel.message_type)
        return ours == wire_layout(other._store, other._channel.message_type)

    def _deserialise(self, store: Typestore, data: bytes | memoryview) -> object:
        """Deserialise without rosbags' check that nothing trails."""
        kind = store.get_msgdef(self._channel.message_type)
        if self._channel.encoding == "ros1":
            return kind.deserialize_ros1(data, 0, kind.cls, store)[0]
        order = _byte_order(data)
        if order not in CDR_STAMP:
            kind_of = bytes(data[:2]).hex()
            raise ValueError(f"unknown CDR encapsulation {kind_of}; 0000 and 0001 are read")
        function = kind.deserialize_cdr_le if order == 1 else kind.deserialize_cdr_be
        return function(data[4:], 0, kind.cls, store)[0]


def _byte_order(data: bytes | memoryview) -> int:
    return data[1] if len(data) >= 4 and data[0] == 0 else -1  # noqa: PLR2004
