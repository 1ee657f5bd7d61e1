"""The text of a definition: sections as rosbag2 joins them, each ``.msg`` or IDL."""

from __future__ import annotations

import re

from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import get_types_from_msg

from graspe_data.errors import RecordingError
from graspe_data.recordings.idl_definitions import parse_idl

MAXIMUM_DEFINITION = 1 << 18
MAXIMUM_LINES = 1 << 13
SECTION = re.compile(r"^={80}[ \t]*\r?\n", re.MULTILINE)
SECTION_NAME = re.compile(r"(IDL|MSG):[ \t]*([A-Za-z0-9_/]{1,200})[ \t]*(?:\r?\n|$)")
IDLE_LINE = re.compile(r"^[ \t\r]*(?:#[^\n]*)?\n", re.MULTILINE)
SEPARATOR = "=" * 80 + "\n"


def parse_definition(message_type: str, text: str, form: str) -> Typesdict:
    """Parse all sections of a definition.

    Args:
        message_type: What a first section without a name defines.
        text: The definition.
        form: ``msg`` or ``idl``, of sections that do not say it themselves.

    Raises:
        RecordingError: It is larger than definitions are.
        ValueError: It does not parse; or what the parser of ``.msg`` raises.
    """
    if len(text) > MAXIMUM_DEFINITION:
        raise RecordingError(
            f"{message_type}: its definition has {len(text)} characters; no more than "
            f"{MAXIMUM_DEFINITION} are read."
        )
    types: Typesdict = {}
    messages = []
    for name, kind, content in _sections(message_type, text, form):
        if kind == "idl":
            types.update(parse_idl(content))
        else:
            messages.append((name, IDLE_LINE.sub("", content.rstrip() + "\n")))
    if sum(content.count("\n") for _, content in messages) > MAXIMUM_LINES:
        raise RecordingError(f"{message_type}: its definition has more than {MAXIMUM_LINES} lines.")
    if messages:
        (first, body), rest = messages[0], messages[1:]
        joined = body + "".join(f"{SEPARATOR}MSG: {name}\n{part}" for name, part in rest)
        types.update(get_types_from_msg(joined, first))
    return types


def _sections(message_type: str, text: str, form: str) -> list[tuple[str, str, str]]:
    """Name, form and content of each section; one without a name is of the message itself."""
    sections = []
    for content in SECTION.split(text):
        named = SECTION_NAME.match(content)
        if named is not None:
            sections.append((named[2], named[1].lower(), content[named.end() :]))
        elif content.strip() or form == "msg":
            sections.append((message_type, form, content))
    return sections
