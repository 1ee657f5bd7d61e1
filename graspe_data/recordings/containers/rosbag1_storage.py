"""ROS 1 bags: by their index where it is sound, else by what a scan of the file finds."""

from __future__ import annotations

import re
from collections import Counter

from rosbags import rosbag1
from rosbags.interfaces import Connection

from graspe_data.errors import RecordingError
from graspe_data.recordings.containers.chunked_storage import ChunkedStorage
from graspe_data.recordings.containers.chunks import ChunkSpan, overlapping
from graspe_data.recordings.containers.rosbag1_records import (
    CHUNK,
    parse_record,
    u32,
    walk_messages,
)
from graspe_data.recordings.containers.rosbag1_salvage import scan_bag
from graspe_data.recordings.containers.storage import Channel, Source
from graspe_data.recordings.message_types import normalise_type
from graspe_data.recordings.messages import Damage

# Before version 2.0 recorders called themselves ROSLOG and ROSRECORD (ros_comm, FORMATS).
VERSION_LINE = re.compile(rb"#ROS(?:BAG|RECORD|LOG) V(\d{1,3}\.\d{1,3})\n")
HEADER_BYTES = 4096
CONVERSION = (
    "Convert it once where ROS 1 is installed: `rosbag reindex OLD.bag` rewrites bags of version "
    "1.2, `rosbag fix OLD.bag NEW.bag` also migrates message types that changed since."
)


class _IndexReader(rosbag1.Reader):
    """Reads connections and chunk infos, not the index of every message, which grows with time."""

    def read_index_data(self, pos: int, indexes: object) -> None:
        """Skip: chunks are read whole, so their messages need no index."""


class BagStorage(ChunkedStorage):
    """One ``.bag`` or ``.bag.active`` file."""

    walk = staticmethod(walk_messages)

    def _open(self) -> None:
        path = self._source.path
        version = VERSION_LINE.match(self._source.read(0, 32))
        if version is not None and version[1] != b"2.0":
            raise RecordingError(
                f"{path}: is a ROS 1 bag of version {version[1].decode()}; only 2.0 is read. "
                f"{CONVERSION}"
            )
        try:
            self.channels, self._spans = read_index(self._source)
        except RecordingError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever a broken index leads to
            found = scan_bag(self._source)
            self.channels, self._spans = found.channels, found.spans
            self.losses = [
                Damage(f"{path.name}: no usable index ({error}); read by scanning"),
                *found.losses,
            ]


def read_index(source: Source) -> tuple[dict[int, Channel], list[ChunkSpan]]:
    """Connections and chunks by the index; any exception where it is not sound."""
    with _IndexReader(source.path) as bag:
        connections = list(bag.connections)
        infos = list(bag.chunk_infos)
    counts: Counter[int] = Counter()
    for info in infos:
        counts.update(info.connection_counts)
    spans = []
    for info in infos:
        record = parse_record(source.read(info.pos, HEADER_BYTES), 0)
        start = info.pos + record.data_offset
        if record.op != CHUNK or start + record.data_size > source.size:
            raise ValueError(f"the chunk at byte {info.pos} does not lie within the file")
        spans.append(
            ChunkSpan(
                start,
                record.data_size,
                record.fields[b"compression"].decode(),
                u32(record.fields, b"size"),
                start_ns=info.start_time if info.connection_counts else 0,
                stop_ns=info.end_time,
                counts=info.connection_counts,
            )
        )
    if overlapping(spans):
        raise ValueError("the index lists chunks that claim the same bytes")
    if unknown := counts.keys() - {connection.id for connection in connections}:
        raise ValueError(f"the index counts messages of unknown connections {sorted(unknown)[:5]}")
    return {item.id: _channel(item, counts[item.id]) for item in connections}, spans


def _channel(connection: Connection, count: int) -> Channel:
    return Channel(
        connection.topic,
        normalise_type(connection.msgtype),
        "ros1",
        connection.msgdef.data,
        "msg",
        count,
    )
