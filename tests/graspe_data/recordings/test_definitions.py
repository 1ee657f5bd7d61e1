"""Definitions in a recording: IDL and text as rosbag2 writes them, within a budget of work."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer
from rosbags.typesys import get_types_from_idl

from graspe_data.errors import RecordingError
from graspe_data.recordings import open_recording
from graspe_data.recordings.definition_text import parse_definition
from graspe_data.recordings.idl_definitions import parse_idl
from graspe_data.recordings.message_decoder import MessageDecoder
from graspe_data.recordings.message_types import default_typestore, message_classes, resolve_type
from graspe_data.recordings.recording import MAXIMUM_DEFINITIONS
from tests.graspe_data.recordings.idl_text import idl_text

LINE = "=" * 80
VECTOR = (
    "module geometry_msgs { module msg { struct Vector3 { double x; double y; double z; }; }; };"
)
TWIST = """#include "geometry_msgs/msg/Vector3.idl"
module geometry_msgs { module msg {
  @verbatim (language="comment", text=
    "This expresses velocity (in two parts)" "\\n" "linear; angular")
  struct Twist { geometry_msgs::msg::Vector3 linear; geometry_msgs::msg::Vector3 angular; };
}; };"""
EVERYTHING = """
// generated from a definition
#include "std_msgs/msg/Header.idl"
module a { module msg {
  module All_Constants { const unsigned long N = 3; const string WORD = "a;b"; };
  typedef double double__9[9];
  typedef sequence<float> floats;
  struct Part { @default (value=0.5) double x; octet byte_; char letter; boolean ok; };
  /* a comment; struct No { long x; }; */
  struct All {
    std_msgs::msg::Header header;
    double__9 covariance;
    floats many;
    sequence<a::msg::Part> parts;
    sequence<Part, 5> few;
    string<7> short_name;
    string name;
    sequence<string> names;
    Part three[3];
    float four[4];
    @unit (value="m")
    long x, y;
    long long i64; unsigned long long u64; short i16; unsigned short u16; unsigned long u32;
    int8 a; uint8 b; int16 c; uint16 d; int32 e; uint32 f; int64 g; uint64 h;
  };
}; };
"""
CDR_HI = b"\0\1\0\0\3\0\0\0hi\0"


def _mcap(path: Path, *channels: tuple[str, str, str, str, str, bytes]) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        for topic, name, form, text, encoding, data in channels:
            schema = writer.register_schema(name, form, text.encode())
            writer.add_message(writer.register_channel(topic, encoding, schema), 1, data, 1)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def _fields(types: Any) -> dict[str, list[tuple[str, Any]]]:
    return {name: [(field, kind) for field, kind in body[1]] for name, body in types.items()}


def test_idl_gives_the_fields_that_rosbags_gives() -> None:
    for text in (VECTOR, TWIST, EVERYTHING):
        plain = "\n".join(line for line in text.splitlines() if not line.startswith("#"))
        ours, theirs = _fields(parse_idl(text)), _fields(get_types_from_idl(plain))
        assert ours.keys() == theirs.keys()
        for name, fields in theirs.items():
            assert ours[name] == fields, name


def test_idl_of_every_standard_type_gives_its_fields() -> None:
    types = default_typestore("cdr").fielddefs
    written = [name for name in types if types[name][1]]
    assert len(written) > 150
    for name in written:
        assert parse_idl(idl_text(name))[name][1] == types[name][1], name


@given(st.integers(1, 40), st.integers(1, 9), st.sampled_from(["+", "*", "-", "|", "&", "^", "<<"]))
def test_bounds_are_computed_as_rosbags_computes_them(one: int, two: int, sign: str) -> None:
    text = (
        f"module a {{ module msg {{ const long N = {one + 40} {sign} {two}; "
        "struct B { double x[N]; }; }; };"
    )
    assert _fields(parse_idl(text)) == _fields(get_types_from_idl(text))


def test_what_rosbags_does_not_read() -> None:
    text = """module a { module msg {
      enum Mode { IDLE, DRIVING = 4, LAST };
      struct B { Mode mode; sequence<string<3>> names; double x[(Mode2::N << 1) + 1]; };
    }; };"""
    with pytest.raises(ValueError, match="Mode2"):
        parse_idl(text)
    fields = dict(_fields(parse_idl(text.replace("Mode2::N", "DRIVING")))["a/msg/B"])
    assert fields["mode"][1] == ("uint32", 0)
    assert fields["x"][1][1] == 9
    assert fields["names"][1][0][1] == ("string", 3)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "module a {",
        "module a { struct B { long x } };",
        "module a { struct B { long x; long x; }; };",
        "module a { struct B { sequence<sequence<long>> x; }; };",
        "module a { struct B { long x[1 << 64]; }; };",
        "module a { struct B { long x[1 / 0]; }; };",
        "module a { struct B { long x[-1]; }; };",
        "module a { union B switch (long) { case 1: long x; }; };",
        "/* never closed module a { struct B { long x; }; };",
        'module a { const string S = "never closed; };',
        "module a " * 50 + "{",
        "module a { struct B { long x[" + "(" * 50 + "1" + ")" * 50 + "]; }; };",
        "module a { struct B { " + "sequence<" * 5000 + "long" + ">" * 5000 + " x; }; };",
    ],
)
def test_idl_that_is_none_is_told(text: str) -> None:
    with pytest.raises((ValueError, RecursionError)):
        parse_idl(text)


@pytest.mark.parametrize("depth", [4, 12])
def test_nested_constants_cost_no_more_than_their_tokens(
    depth: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from graspe_data.recordings.idl_tokens import IdlTokens  # noqa: PLC0415

    taken = 0
    take = IdlTokens.next

    def counted(self: IdlTokens) -> str:
        nonlocal taken
        taken += 1
        return take(self)

    monkeypatch.setattr(IdlTokens, "next", counted)
    constant = "(" * depth + "1" + ")" * depth
    text = f"module a {{ module msg {{ const long X = {constant}; struct B {{ long x; }}; }}; }};"
    assert _fields(parse_idl(text))["a/msg/B"]
    assert taken < 60


def _sections(*parts: tuple[str, str, str]) -> str:
    return "".join(f"{LINE}\n{kind}: {name}\n{text}\n\n" for kind, name, text in parts)


@pytest.mark.parametrize(
    "text",
    [
        _sections(
            ("IDL", "geometry_msgs/msg/Twist", TWIST), ("IDL", "geometry_msgs/msg/Vector3", VECTOR)
        ),
        _sections(
            ("IDL", "geometry_msgs/msg/Twist", TWIST),
            ("MSG", "geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z"),
        ),
        f"{TWIST}\n{_sections(('IDL', 'geometry_msgs/msg/Vector3', VECTOR))}",
        TWIST,
    ],
)
def test_sections_as_rosbag2_joins_them(text: str) -> None:
    found = resolve_type("geometry_msgs/msg/Twist", "cdr", text, "idl")
    assert (found.fault, found.note) == ("", "")
    types = _fields(parse_definition("geometry_msgs/msg/Twist", text, "idl"))
    assert [name for name, _ in types["geometry_msgs/msg/Twist"]] == ["linear", "angular"]


def test_idl_decodes_messages_of_a_type_of_its_own(tmp_path: Path) -> None:
    text = _sections(
        (
            "IDL",
            "robot/msg/Speeds",
            ("module robot { module msg { struct Speeds { uint16 id; sequence<float> v; }; }; };"),
        )
    )
    data = b"\0\1\0\0" + b"\7\0\0\0" + b"\2\0\0\0" + b"\0\0\x80\x3f\0\0\0\x40"
    path = _mcap(tmp_path / "a.mcap", ("/v", "robot/msg/Speeds", "ros2idl", text, "cdr", data))
    with open_recording(path) as recording:
        message: Any = recording.decode(next(recording.messages()))
        assert (message.id, list(message.v)) == (7, [1.0, 2.0])


@pytest.mark.parametrize("text", ["what is this?", "module x {", "string data\nBroken[[ x"])
@pytest.mark.parametrize("form", ["ros2msg", "ros2idl"])
def test_the_standard_type_stands_in_for_a_text_that_does_not_parse(
    tmp_path: Path, text: str, form: str
) -> None:
    path = _mcap(
        tmp_path / "a.mcap",
        ("/words", "std_msgs/msg/String", form, text, "cdr", CDR_HI),
        ("/own", "robot/msg/Own", form, text, "cdr", CDR_HI),
    )
    with open_recording(path) as recording:
        raws = {raw.topic: raw for raw in recording.messages()}
        words: Any = recording.decode(raws["/words"])
        assert words.data == "hi"
        (note,) = recording.notes
        assert note.startswith("/words: ")
        assert "The standard std_msgs/msg/String is used" in note
        assert recording.losses == []
        with pytest.raises(RecordingError, match="no standard type of this name"):
            recording.decode(raws["/own"])


@pytest.mark.parametrize(
    ("form", "encoding"), [("ros2msg", "cdr"), ("ros2idl", "cdr"), ("ros1msg", "ros1")]
)
def test_an_empty_encoding_follows_from_the_schema(
    tmp_path: Path, form: str, encoding: str
) -> None:
    data = CDR_HI if encoding == "cdr" else b"\2\0\0\0hi"
    path = _mcap(tmp_path / "a.mcap", ("/w", "std_msgs/msg/String", form, "", "", data))
    with open_recording(path) as recording:
        assert recording.topics["/w"].encoding == encoding
        message: Any = recording.decode(next(recording.messages()))
        assert message.data == "hi"


@pytest.mark.parametrize(
    "definition",
    [
        "Own[] a\n",
        "Own a\n",
        "A a\n" + LINE + "\nMSG: robot/A\nOwn o\n",
        "A[60000] a\n" + LINE + "\nMSG: robot/A\nuint8 x\n",
        "string[60000] a\n",
        "uint8[99999999] a\n",
        "float64 x\n" * 9000,
        "".join(
            (f"{LINE}\nMSG: robot/A{level}\n" if level else "")
            + f"A{level + 1} a\nA{level + 1} b\nA{level + 1} c\n"
            for level in range(20)
        )
        + f"{LINE}\nMSG: robot/A20\n",
    ],
)
def test_a_type_that_unfolds_without_end_is_refused(definition: str) -> None:
    found = resolve_type("robot/msg/Own", "ros1", definition, "msg")
    assert found.store is None
    assert "robot/msg/Own" in found.fault or "array" in found.fault


def test_channels_of_one_definition_share_one_parse(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    resolve_type.cache_clear()
    channels = [
        (f"/x{number}", "robot/msg/Own", "ros2msg", "string shared_by_all\n", "cdr", CDR_HI)
        for number in range(50)
    ]
    with open_recording(_mcap(tmp_path / "a.mcap", *channels)) as recording:
        for raw in recording.messages():
            recording.decode(raw)
    assert resolve_type.cache_info().misses == 1


def test_definitions_are_parsed_within_a_budget(tmp_path: Path) -> None:
    comment = "#" + "x" * (200 << 10)
    channels = [
        (f"/x{number}", f"robot/msg/Own{number}", "ros2msg", f"{comment}{number}\n", "cdr", CDR_HI)
        for number in range(MAXIMUM_DEFINITIONS // len(comment) + 2)
    ]
    with open_recording(_mcap(tmp_path / "a.mcap", *channels)) as recording:
        faults = []
        for raw in recording.messages():
            try:
                recording.decode(raw)
            except RecordingError as error:
                faults.append(str(error))
        assert len(faults) == 2
        assert all("holds no definition" in fault for fault in faults)


def test_every_standard_type_keeps_its_layout() -> None:
    from graspe_data.recordings.containers.storage import Channel  # noqa: PLC0415

    for name in ("sensor_msgs/msg/PointCloud2", "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage"):
        assert name in message_classes()
        assert MessageDecoder(Channel("/x", name, "cdr")).reads_alike(
            MessageDecoder(Channel("/y", name, "cdr"))
        )
