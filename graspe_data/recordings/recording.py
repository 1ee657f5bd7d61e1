"""Open any recording: ROS 1 bags, rosbag2 folders, bare db3 and MCAP files, whole or damaged."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal, Self

from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.mcap_storage import McapStorage
from graspe_data.recordings.containers.rosbag1_storage import BagStorage
from graspe_data.recordings.containers.sqlite_storage import SqliteStorage
from graspe_data.recordings.containers.storage import Channel, Storage
from graspe_data.recordings.layout import Layout, find_layout
from graspe_data.recordings.message_decoder import MessageDecoder
from graspe_data.recordings.messages import Damage, RawMessage, TopicInfo

Format = Literal["rosbag1", "sqlite3", "mcap"]

# Beyond that, types are taken by their names; real recordings have a tenth.
MAXIMUM_DEFINITIONS = 4 << 20
MAGIC = {"rosbag1": b"#ROSBAG V", "mcap": b"\x89MCAP"}


def open_recording(path: str | Path) -> Recording:
    """Open a recording for reading.

    Args:
        path: A ``.bag`` or ``.bag.active``, a ``.db3``, ``.db3.zstd`` or ``.mcap``, or a folder
            of rosbag2, with or without its metadata.yaml. The content decides, not the name.

    Raises:
        RecordingError: There is no recording, or nothing of it can be read.
    """
    layout = find_layout(Path(path))
    try:
        return Recording(layout)
    except BaseException:
        layout.close()
        raise


class Recording:
    """A recording open for reading; a context manager.

    Damage does not stop it: what can be read is read, and `losses` says what could not.
    """

    def __init__(self, layout: Layout) -> None:
        """Open the files of a layout; `open_recording` finds it."""
        self.path = layout.path
        self.files: list[Path] = list(layout.files)
        self.format: Format = layout.format
        self._layout = layout
        self._opening: list[Damage] = list(layout.losses)
        self._pass: list[Damage] = []
        self._decoders: dict[Channel, MessageDecoder] = {}
        self._topic_decoders: dict[str, MessageDecoder] = {}
        self._definitions: set[str] = set()
        self._storages = self._open_storages()
        self._channels = self._join_channels()
        self.topics: Mapping[str, TopicInfo] = {
            topic: self._topic_info(topic) for topic in sorted(self._channels)
        }

    @property
    def losses(self) -> list[Damage]:
        """What is missing: found on opening, and in the last pass of `messages`."""
        return [*self._opening, *self._pass]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided on reading, and costs no message: each with its topic."""
        found = [(topic, self._decoder(channel).note) for topic, channel in self._channels.items()]
        return tuple(f"{topic}: {note}" for topic, note in sorted(found) if note)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[RawMessage]:
        """Yield the messages of some topics, or of all, the same ones each time.

        Files come one after another; within one, order is by bag time where an index gives it,
        and by place in a file that had to be salvaged. A chunk at a time is in memory.

        Raises:
            RecordingError: A topic that the recording does not have; a file that vanished.
        """
        chosen = self.topics.keys() if topics is None else set(topics)
        if unknown := sorted(chosen - self.topics.keys()):
            raise RecordingError(
                f"{self.path}: no topic {', '.join(unknown)}; it has {', '.join(self.topics)}."
            )
        return self._messages(chosen)

    def decode(self, raw: RawMessage) -> object:
        """Decode a message to an object with the attributes of its ROS type.

        By the definition in the recording, else by the standard one; trailing bytes are ignored.

        Raises:
            RecordingError: There is no definition, or the message does not fit it.
        """
        try:
            return self._topic_decoder(raw.topic).decode(raw.data)
        except RecordingError as error:
            where = f"{self.path}: topic {raw.topic} at {raw.bag_time_ns} ns"
            raise RecordingError(f"{where}: {error}") from error

    def header_stamp_ns(self, raw: RawMessage) -> int | None:
        """The header stamp, read at its place in the bytes.

        None for a type without header, and for a message too short to hold one.
        """
        return self._topic_decoder(raw.topic).header_stamp_ns(raw.data)

    def close(self) -> None:
        """Close the files and remove what was decompressed."""
        for storage in self._storages:
            storage.close()
        self._layout.close()

    def __enter__(self) -> Self:
        """Give the recording itself; it is open already."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it."""
        self.close()

    def _open_storages(self) -> list[Storage]:
        storages: list[Storage] = []
        faults: list[RecordingError] = []
        for path in self._layout.readable:
            try:
                storages.append(self._open_storage(path))
            except RecordingError as error:
                faults.append(error)
                self._opening.append(Damage(str(error)))
        if faults and not storages:
            raise faults[0]
        position = 0
        for storage in storages:
            self._opening += storage.losses
            storage.first_position = position
            position += storage.positions
        return storages

    def _open_storage(self, path: Path) -> Storage:
        compressed = self._layout.compressed_messages
        if self.format == "sqlite3":
            return SqliteStorage(path, compressed_messages=compressed)
        storage: Storage = (
            BagStorage(path, compressed_messages=False)
            if self.format == "rosbag1"
            else McapStorage(path, compressed_messages=compressed)
        )
        if not storage.channels and not _begins_with(path, MAGIC[self.format]):
            storage.close()
            raise RecordingError(
                f"{path}: no recording: it does not begin as a {self.format} file does, and "
                f"nothing in it reads as one."
            )
        return storage

    def _join_channels(self) -> dict[str, Channel]:
        """One channel a topic: the first, and the first definition of its type."""
        joined: dict[str, Channel] = {}
        for storage in self._storages:
            for _, channel in sorted(storage.channels.items()):
                known = joined.setdefault(channel.topic, channel)
                if not known.definition and known.message_type == channel.message_type:
                    joined[channel.topic] = channel
        for topic, (message_type, encoding) in self._layout.topics.items():
            joined.setdefault(topic, Channel(topic, message_type, encoding))
        return joined

    def _topic_info(self, topic: str) -> TopicInfo:
        channel = self._channels[topic]
        counts = [
            other.count
            for storage in self._storages
            for other in storage.channels.values()
            if other.topic == topic and self._reads_alike(other)
        ]
        known = [count for count in counts if count is not None]
        complete = bool(counts) and len(known) == len(counts)
        total = sum(known) if complete else self._layout.counts.get(topic)
        return TopicInfo(topic, channel.message_type, channel.encoding, total)

    def _messages(self, chosen: Collection[str]) -> Iterator[RawMessage]:
        losses: list[Damage] = []
        self._pass = losses
        yielded: Counter[str] = Counter()
        for storage in self._storages:
            for message in storage.messages(self._wanted(storage, chosen, losses), losses):
                yielded[message.topic] += 1
                yield message
        losses += list(self._undelivered(chosen, yielded, losses))

    def _wanted(self, storage: Storage, chosen: Collection[str], losses: list[Damage]) -> set[int]:
        """The channels of the chosen topics; a second type on a topic is a loss."""
        wanted = set()
        for number, channel in sorted(storage.channels.items()):
            if channel.topic not in chosen:
                continue
            if self._reads_alike(channel):
                wanted.add(number)
            elif channel.count != 0:
                expected = self._channels[channel.topic].message_type
                reason = f"also carries {channel.message_type}; only {expected} is read"
                losses.append(Damage(f"{channel.topic}: {reason}", channel.topic, channel.count))
        return wanted

    def _undelivered(
        self, chosen: Collection[str], yielded: Counter[str], losses: Collection[Damage]
    ) -> Iterator[Damage]:
        """Messages that metadata.yaml counts and no loss has explained yet."""
        for topic in sorted(chosen):
            explained = sum(loss.messages or 0 for loss in losses if loss.topic == topic)
            missing = self._layout.counts.get(topic, 0) - yielded[topic] - explained
            if missing > 0:
                yield Damage("metadata.yaml counts messages that the files lack", topic, missing)

    def _reads_alike(self, channel: Channel) -> bool:
        expected = self._channels[channel.topic]
        if _kind(channel) == _kind(expected):
            return True
        return self._decoder(channel).reads_alike(self._decoder(expected))

    def _topic_decoder(self, topic: str) -> MessageDecoder:
        """That of a topic's channel, by a key that is quicker to look up."""
        if topic not in self._topic_decoders:
            self._topic_decoders[topic] = self._decoder(self._channels[topic])
        return self._topic_decoders[topic]

    def _decoder(self, channel: Channel) -> MessageDecoder:
        if channel not in self._decoders:
            self._definitions.add(channel.definition)
            spent = sum(len(text) for text in self._definitions)
            kept = channel if spent <= MAXIMUM_DEFINITIONS else replace(channel, definition="")
            self._decoders[channel] = MessageDecoder(kept)
        return self._decoders[channel]


def _kind(channel: Channel) -> tuple[str, str, str]:
    return channel.message_type, channel.encoding, channel.schema


def _begins_with(path: Path, magic: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(len(magic)) == magic
