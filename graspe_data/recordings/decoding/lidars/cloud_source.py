"""The clouds of one topic, whatever a message of it holds: a cloud, a scan or a packet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.recordings.decoding.cloud_decoder import cloud_decoder
from graspe_data.recordings.decoding.header import refuses_unfit_messages
from graspe_data.recordings.decoding.lidars.hesai import HESAI_TYPES, HesaiDecoder
from graspe_data.recordings.decoding.lidars.ouster import OUSTER_TYPES, OusterDecoder
from graspe_data.recordings.decoding.lidars.ouster_metadata import parse_metadata
from graspe_data.recordings.decoding.lidars.scan_assembly import ScanAssembler
from graspe_data.recordings.messages import RawMessage
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Lidar
from graspe_data.sensor_data import PointCloud

STRING = "std_msgs/msg/String"
LEAST_SHARE = 0.5
"""Of a scan: of which less is there, as where a recording begins within it, is no cloud."""


@dataclass(frozen=True)
class CloudMessage:
    """One cloud of a recording, not decoded yet.

    ``stamp_ns``: of its header, or of its first column; None where it has none, or where the
    sensor counts from when it was switched on. ``bag_time_ns``: of its first message; ``position``:
    of the message that completes it. ``share``: how much of a whole scan is there. ``decode`` and
    ``frame`` raise RecordingError.
    """

    topic: str
    stamp_ns: int | None
    bag_time_ns: int
    decode: Callable[[], PointCloud] = field(repr=False)
    frame: Callable[[], str] = field(repr=False, default=str)
    share: float = 1.0
    position: int = 0


class CloudSource:
    """Turns the messages of one topic, fed in order, into clouds.

    A scan of which less than half is there is none.

    Two passes over a recording give the same clouds in the same order, so that the ordinal of a
    cloud names it, as the ordinal of a message names one of another topic.
    """

    def __init__(self, recording: Recording, topic: str, lidar: Lidar) -> None:
        """Choose the decoder of a topic; for Ouster packets, read the metadata beside it.

        Raises:
            RecordingError: No cloud in such messages, or packets without metadata.
        """
        self._recording, self.topic = recording, topic
        self._kind = recording.topics[topic].message_type
        self._assembler: ScanAssembler | None = None
        self._hesai: HesaiDecoder | None = None
        self._decode: Callable[[object], PointCloud]
        self._position = 0
        if self._kind in OUSTER_TYPES:
            text, where = ouster_metadata(recording, topic)
            self._assembler = ScanAssembler(OusterDecoder(parse_metadata(text, where), topic))
            self._internal = parse_metadata(text, where).internal_clock
        elif self._kind in HESAI_TYPES:
            hesai = HesaiDecoder(lidar.model, Path(lidar.angles) if lidar.angles else None)
            self._decode = lambda message: hesai.decode(message, topic)
            self._hesai = hesai
        else:
            self._decode = cloud_decoder(self._kind, topic, lidar)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of the clouds, once one was decoded."""
        return () if self._hesai is None else self._hesai.notes

    @property
    def joins(self) -> bool:
        """Whether a cloud is joined of many messages."""
        return self._assembler is not None

    def take(self, raw: RawMessage) -> CloudMessage | None:
        """Take the next message of the topic; gives the cloud that it completes, if any.

        Raises:
            RecordingError: A packet that is damaged; what follows is read on.
        """
        if self._assembler is None:
            return CloudMessage(
                self.topic,
                self._recording.header_stamp_ns(raw),
                raw.bag_time_ns,
                lambda: self._decode(self._recording.decode(raw)),
                lambda: self._frame_of(raw),
                position=raw.position,
            )
        packet = _buffer(self._recording.decode(raw))
        self._position = raw.position
        return self._message(self._assembler.take(packet, raw.bag_time_ns))

    def rest(self) -> CloudMessage | None:
        """The cloud that the end of the recording cuts off, if any."""
        return None if self._assembler is None else self._message(self._assembler.rest())

    def gather(self, messages: Iterable[RawMessage]) -> Iterator[RawMessage | CloudMessage]:
        """Yield messages as they come, but clouds in place of the messages of the topic.

        Raises:
            RecordingError: See `take`.
        """
        for raw in messages:
            if raw.topic != self.topic:
                yield raw
            elif cloud := self.take(raw):
                yield cloud
        if cloud := self.rest():
            yield cloud

    def _frame_of(self, raw: RawMessage) -> str:
        message = self._recording.decode(raw)
        if self._hesai is not None:
            self._hesai.decode(message, self.topic)
        return _frame(message)

    def _message(self, scan: Any) -> CloudMessage | None:
        if scan is None:
            return None
        if scan.share < LEAST_SHARE:
            return None
        stamp = None if self._internal else scan.stamp_ns
        return CloudMessage(
            self.topic,
            stamp,
            scan.bag_time_ns,
            scan.cloud,
            lambda: str(scan.cloud().frame),
            scan.share,
            self._position,
        )


def ouster_metadata(recording: Recording, topic: str) -> tuple[str, str]:
    """The last metadata of the sensor whose packets a topic holds, and where it was found.

    Its topic is named ``metadata`` in the same namespace (``/os_node0/metadata`` of ROS 1,
    ``/ouster/metadata`` of ROS 2); where there is none, the only one of the recording counts.

    Raises:
        RecordingError: There is none, or it cannot be told which.
    """
    named = [
        name
        for name, info in recording.topics.items()
        if info.message_type == STRING and name.rsplit("/", 1)[-1] == "metadata"
    ]
    beside = f"{topic.rsplit('/', 1)[0]}/metadata"
    chosen = [beside] if beside in named else named
    if len(chosen) != 1:
        found = f"found {', '.join(chosen)}" if chosen else "found none"
        raise RecordingError(
            f"{recording.path}: {topic}: Ouster packets need the metadata of their sensor on "
            f"{beside} [{STRING}]; {found}. Record it with the packets (the ROS 2 driver sends it "
            f"once, latched), or record the driver's PointCloud2."
        )
    texts = [str(getattr(recording.decode(raw), "data", "")) for raw in recording.messages(chosen)]
    if not texts:
        raise RecordingError(f"{recording.path}: no message on {chosen[0]}, which {topic} needs.")
    return texts[-1], f"{recording.path}: {chosen[0]}"


@refuses_unfit_messages
def _frame(message: Any) -> str:
    return str(message.header.frame_id)


@refuses_unfit_messages
def _buffer(message: Any) -> np.ndarray[Any, np.dtype[np.uint8]]:
    return np.asarray(message.buf, np.uint8)
