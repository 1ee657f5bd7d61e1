"""Message types: from the definitions in a recording, or from the stores that ship."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Mapping
from typing import Literal, NamedTuple

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc, Typesdict
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from graspe_data.errors import RecordingError
from graspe_data.recordings.definition_limits import check_limits, layout_digest
from graspe_data.recordings.definition_text import parse_definition

HEADER = "std_msgs/msg/Header"
TIME = "builtin_interfaces/msg/Time"
TYPE_NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)*/(msg|srv|action)/[A-Za-z]\w*", re.ASCII)
UNDEFINED = (
    "the recording holds no definition of this type, and the standard ones do not have it. Record "
    "with a format that keeps definitions (MCAP, or db3 of ROS 2 Iron and later)."
)

# Types that recordings are full of and the stores of rosbags do not hold.
TRANSFORMS = "geometry_msgs/TransformStamped[] transforms\n"
LIVOX_POINT = (
    "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\n"
    "uint8 reflectivity\nuint8 tag\nuint8 line\n"
)
LIVOX_CLOUD = (
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
    "CustomPoint[] points\n"
)
OUSTER_PACKET = "uint8[] buf\n"
ADDED_TO_BOTH = {
    "livox_ros_driver/msg/CustomPoint": LIVOX_POINT,
    "livox_ros_driver/msg/CustomMsg": LIVOX_CLOUD,
    "livox_ros_driver2/msg/CustomPoint": LIVOX_POINT,
    "livox_ros_driver2/msg/CustomMsg": LIVOX_CLOUD,
    "ouster_ros/msg/PacketMsg": OUSTER_PACKET,
    "ouster_msgs/msg/PacketMsg": OUSTER_PACKET,
    "ouster_sensor_msgs/msg/PacketMsg": OUSTER_PACKET,
    "pandar_msgs/msg/PandarPacket": (
        "builtin_interfaces/Time stamp\nuint8[1500] data\nuint32 size\n"
    ),
    "pandar_msgs/msg/PandarScan": "std_msgs/Header header\nPandarPacket[] packets\n",
    "nebula_msgs/msg/NebulaPacket": "builtin_interfaces/Time stamp\nuint8[] data\n",
    "nebula_msgs/msg/NebulaPackets": "std_msgs/Header header\nNebulaPacket[] packets\n",
    "velodyne_msgs/msg/VelodynePacket": "builtin_interfaces/Time stamp\nuint8[1206] data\n",
    "velodyne_msgs/msg/VelodyneScan": "std_msgs/Header header\nVelodynePacket[] packets\n",
    "foxglove_msgs/msg/CompressedVideo": (
        "builtin_interfaces/Time timestamp\nstring frame_id\nuint8[] data\nstring format\n"
    ),
    "ffmpeg_image_transport_msgs/msg/FFMPEGPacket": (
        "std_msgs/Header header\nint32 width\nint32 height\nstring encoding\nuint64 pts\n"
        "uint8 flags\nbool is_bigendian\nuint8[] data\n"
    ),
}
ADDED_TO_ROS1 = {"tf2_msgs/msg/TFMessage": TRANSFORMS, "tf/msg/tfMessage": TRANSFORMS}


def normalise_type(name: str) -> str:
    """Spell a message type as ``package/msg/Name``, whichever way it was written."""
    parts = [part for part in name.split("/") if part]
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 else "/".join(parts)  # noqa: PLR2004


@functools.cache
def default_typestore(encoding: str) -> Typestore:
    """The store for recordings without definitions: ``ros1`` Noetic, ``cdr`` Jazzy."""
    store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_JAZZY)
    added = {**ADDED_TO_BOTH, **(ADDED_TO_ROS1 if encoding == "ros1" else {})}
    for name, text in added.items():
        store.register(get_types_from_msg(text, name))
    return store


def message_classes() -> Mapping[str, type]:
    """The classes of ROS 2 messages by ``package/msg/Name``, to build messages with."""
    return default_typestore("cdr").types


class MessageType(NamedTuple):
    """What decodes a type: a store or the fault; and what the user should know of the choice."""

    store: Typestore | None
    fault: str = ""
    note: str = ""


@functools.lru_cache(maxsize=256)
def resolve_type(
    message_type: str, encoding: str, definition: str, definition_format: str
) -> MessageType:
    """Find what decodes a type; the same definition is parsed once.

    Args:
        message_type: ``package/msg/Name``.
        encoding: ``ros1`` or ``cdr``.
        definition: The text in the recording; empty falls back to the default store.
        definition_format: ``msg`` or ``idl``.

    Returns:
        By the definition, else by the standard type of that name, else a fault.
    """
    default = default_typestore(encoding)
    if not definition.strip():
        if message_type in default.fielddefs:
            return MessageType(default)
        return MessageType(None, f"{message_type}: {UNDEFINED}")
    try:
        return MessageType(_defined(message_type, default, definition, definition_format))
    except RecordingError as error:
        fault = str(error)
    except Exception as error:  # noqa: BLE001 - whatever a broken text leads to
        fault = f"{message_type}: its definition does not parse: {_first_line(error)}."
    if message_type in default.fielddefs:
        return MessageType(default, note=f"{fault} The standard {message_type} is used.")
    return MessageType(
        None,
        f"{fault} There is no standard type of this name. Record again, or with its definition as "
        f".msg text.",
    )


def _defined(
    message_type: str, default: Typestore, definition: str, definition_format: str
) -> Typestore:
    """The default store where it says the same as the definition, else one of its own."""
    if not TYPE_NAME.fullmatch(message_type):
        raise RecordingError(f"{message_type[:80]!r}: not the name of a message type.")
    fields = parse_definition(message_type, definition, definition_format)
    complete = _with_nested(fields, message_type, default)
    if all(_same(default, name, fields) for name in complete):
        return default
    check_limits(complete, message_type)
    store = get_typestore(Stores.EMPTY)
    store.register(complete)
    store.get_msgdef(message_type)
    return store


def first_stamp(store: Typestore, message_type: str) -> Literal["header", "timestamp", ""]:
    """What a type begins with: a ``std_msgs/Header``, a time in its place, or neither."""
    fields = store.fielddefs[message_type][1]
    if not fields:
        return ""
    name, kind = fields[0]
    if kind == (Nodetype.NAME, HEADER):
        return "header"
    bare = name in ("timestamp", "stamp") and kind == (Nodetype.NAME, TIME)
    return "timestamp" if bare else ""


def wire_layout(store: Typestore, message_type: str) -> bytes:
    """A digest of the fields of a type as they lie on the wire: equal ones read alike.

    A header is one item, since only ROS 1 writes its sequence number.
    """
    return layout_digest(store.fielddefs, message_type, HEADER)


def _with_nested(fields: Typesdict, message_type: str, default: Typestore) -> Typesdict:
    """The type and all that it refers to, missing ones taken from the default store."""
    complete: Typesdict = {}
    waiting = [message_type]
    while waiting:
        name = waiting.pop()
        if name in complete:
            continue
        known = fields.get(name) or default.fielddefs.get(name)
        if known is None:
            raise RecordingError(
                f"{message_type}: its definition refers to {name}, which nothing defines."
            )
        complete[name] = known
        waiting += [other for _, field in known[1] for other in _references(field)]
    return complete


def _references(field: FieldDesc) -> Iterator[str]:
    if field[0] == Nodetype.NAME:
        yield str(field[1])
    elif field[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        inner, _ = field[1]
        yield from _references(inner)  # type: ignore[arg-type, unused-ignore]


def _same(default: Typestore, name: str, fields: Typesdict) -> bool:
    if name not in fields:
        return True
    return name in default.fielddefs and default.fielddefs[name][1] == fields[name][1]


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:160]
