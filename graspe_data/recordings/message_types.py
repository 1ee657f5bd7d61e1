"""Message types: from the definitions in a recording, or from the stores that ship."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Mapping
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc, Typesdict
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from graspe_data.errors import RecordingError

HEADER = "std_msgs/msg/Header"
TIME = "builtin_interfaces/msg/Time"
TYPE_NAME = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*)*/(msg|srv|action)/[A-Za-z]\w*", re.ASCII)
MAXIMUM_DEFINITION = 1 << 20
MAXIMUM_ARRAY = 1 << 16

# Types that recordings are full of and the stores of rosbags do not hold.
TRANSFORMS = "geometry_msgs/TransformStamped[] transforms\n"
ADDED_TO_BOTH = {
    "velodyne_msgs/msg/VelodynePacket": "builtin_interfaces/Time stamp\nuint8[1206] data\n",
    "velodyne_msgs/msg/VelodyneScan": "std_msgs/Header header\nVelodynePacket[] packets\n",
    "foxglove_msgs/msg/CompressedVideo": (
        "builtin_interfaces/Time timestamp\nstring frame_id\nuint8[] data\nstring format\n"
    ),
    "ffmpeg_image_transport_msgs/msg/FFMPEGPacket": (
        "std_msgs/Header header\nint32 width\nint32 height\nstring encoding\nuint64 pts\n"
        "uint8 flags\nbool is_bigendian\nuint8[] data\n"
    ),
    "livox_ros_driver2/msg/CustomPoint": (
        "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\n"
        "uint8 line\n"
    ),
    "livox_ros_driver2/msg/CustomMsg": (
        "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\n"
        "uint8[3] rsvd\nCustomPoint[] points\n"
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


def typestore_for(
    message_type: str, encoding: str, definition: str, definition_format: str
) -> Typestore:
    """Build the store that decodes one message type.

    Args:
        message_type: ``package/msg/Name``.
        encoding: ``ros1`` or ``cdr``.
        definition: The text in the recording; empty falls back to the default store.
        definition_format: ``msg`` or ``idl``.

    Raises:
        RecordingError: The definition does not parse, or there is none and the type is unknown.
    """
    default = default_typestore(encoding)
    if not definition.strip():
        return _known(default, message_type)
    try:
        fields = _parse(message_type, definition, definition_format)
        complete = _with_nested(fields, message_type, default)
        if all(_same(default, name, fields) for name in complete):
            return default
        store = get_typestore(Stores.EMPTY)
        store.register(complete)
        store.get_msgdef(message_type)
    except RecordingError:
        raise
    except Exception as error:
        raise RecordingError(
            f"{message_type}: the definition in the recording does not parse: "
            f"{_first_line(error)}. Record again, or remove the definition so that the "
            f"standard one is used."
        ) from error
    return store


def begins_with_header(store: Typestore, message_type: str) -> bool:
    """Whether the first field of a type is a ``std_msgs/Header``."""
    fields = store.fielddefs[message_type][1]
    return bool(fields) and fields[0][1] == (Nodetype.NAME, HEADER)


def begins_with_stamp(store: Typestore, message_type: str) -> bool:
    """Whether a type has its stamp in place of a header, as Foxglove's types do."""
    fields = store.fielddefs[message_type][1]
    named = bool(fields) and fields[0][0] in ("timestamp", "stamp")
    return named and fields[0][1] == (Nodetype.NAME, TIME)


def wire_layout(store: Typestore, message_type: str) -> tuple[Any, ...]:
    """The fields of a type as they lie on the wire, without names: equal ones read alike.

    A header is one item, since only ROS 1 writes its sequence number.
    """
    if message_type == HEADER:
        return (HEADER,)
    return tuple(_wire(store, field) for _, field in store.fielddefs[message_type][1])


def _wire(store: Typestore, field: Any) -> Any:
    kind, detail = field
    if kind == Nodetype.NAME:
        return wire_layout(store, detail)
    return field if kind == Nodetype.BASE else (kind, _wire(store, detail[0]), detail[1])


def _known(default: Typestore, message_type: str) -> Typestore:
    if message_type not in default.fielddefs:
        raise RecordingError(
            f"{message_type}: the recording holds no definition of this type, and the standard "
            f"ones do not have it. Record with a format that keeps definitions (MCAP, or db3 of "
            f"ROS 2 Iron and later)."
        )
    return default


def _parse(message_type: str, definition: str, definition_format: str) -> Typesdict:
    if not TYPE_NAME.fullmatch(message_type) or len(definition) > MAXIMUM_DEFINITION:
        raise RecordingError(f"{message_type[:80]!r}: not the name of a message type.")
    if definition_format == "idl":
        return get_types_from_idl(definition)
    return get_types_from_msg(definition, message_type)


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
        inner, count = field[1]
        if field[0] == Nodetype.ARRAY and int(count) > MAXIMUM_ARRAY:  # type: ignore[arg-type, unused-ignore]
            raise RecordingError(f"An array of {count} elements in a definition is refused.")
        yield from _references(inner)  # type: ignore[arg-type, unused-ignore]


def _same(default: Typestore, name: str, fields: Typesdict) -> bool:
    if name not in fields:
        return True
    return name in default.fielddefs and default.fielddefs[name][1] == fields[name][1]


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:160]
