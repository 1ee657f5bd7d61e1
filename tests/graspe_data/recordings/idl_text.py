"""IDL for a message type, as rosidl generates it and rosbag2 stores it."""

from __future__ import annotations

from typing import Any

from rosbags.interfaces import Nodetype

from graspe_data.recordings.message_types import default_typestore

BASE = {
    "bool": "boolean",
    "byte": "octet",
    "float32": "float",
    "float64": "double",
}


def idl_sections(message_type: str) -> str:
    """The IDL of a type and of all that it refers to, in sections."""
    types = default_typestore("cdr").fielddefs
    names: dict[str, None] = {}
    waiting = [message_type]
    while waiting:
        name = waiting.pop()
        if name not in names:
            names[name] = None
            waiting += [inner for _, kind in types[name][1] for inner in _references(kind)]
    return "".join(f"{'=' * 80}\nIDL: {name}\n{idl_text(name)}\n" for name in names)


def idl_text(message_type: str) -> str:
    """The IDL of one type."""
    fields = default_typestore("cdr").fielddefs[message_type][1]
    *modules, name = message_type.split("/")
    includes = {inner for _, kind in fields for inner in _references(kind)}
    lines = [f'#include "{inner}.idl"' for inner in sorted(includes)]
    lines += [f"module {module} {{" for module in modules]
    lines += [
        '  @verbatim (language="comment", text=',
        '    "A message." "\\n"',
        '    "Of (two) parts;")',
    ]
    lines += [f"  struct {name} {{", *(_member(field, kind) for field, kind in fields), "  };"]
    return "\n".join([*lines, *("};" for _ in modules)]) + "\n"


def _references(kind: Any) -> list[str]:
    if kind[0] == Nodetype.NAME:
        return [kind[1]]
    return _references(kind[1][0]) if kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) else []


def _member(name: str, kind: Any) -> str:
    if kind[0] == Nodetype.ARRAY:
        return f"    {_spelled(kind[1][0])} {name}[{kind[1][1]}];"
    return f'    @unit (value="m")\n    {_spelled(kind)} {name};'


def _spelled(kind: Any) -> str:
    if kind[0] == Nodetype.NAME:
        return str(kind[1]).replace("/", "::")
    if kind[0] == Nodetype.SEQUENCE:
        bound = f", {kind[1][1]}" if kind[1][1] else ""
        return f"sequence<{_spelled(kind[1][0])}{bound}>"
    name, bound = kind[1]
    return f"{BASE.get(name, name)}<{bound}>" if bound else BASE.get(name, name)
