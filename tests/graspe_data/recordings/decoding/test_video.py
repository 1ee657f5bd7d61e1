"""Every picture of a video belongs to its message, and after a loss there is none."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.recordings.decoding.picture_decoder import PictureDecoder
from graspe_data.recordings.decoding.video import (
    BEFORE_KEY_FRAME,
    DAMAGED,
    NO_PICTURE,
    PACKET_LOST,
    VideoDecoder,
)
from graspe_data.recordings.decoding.video_messages import COMPRESSED_VIDEO, FFMPEG_PACKET
from tests.graspe_data.recordings.decoding.encoded_video import Encoded, encode, number_in

CODECS = ["h264", "hevc"]
KINDS = [COMPRESSED_VIDEO, FFMPEG_PACKET]
FORMATS = {"h264": "h264", "hevc": "h265"}


def message_of(packet: Encoded, kind: str, codec: str) -> Any:
    """The message of a packet, stamped with the number of its picture."""
    stamp, data = SimpleNamespace(sec=packet.number, nanosec=5), np.frombuffer(packet.data, "u1")
    if kind == COMPRESSED_VIDEO:
        return SimpleNamespace(timestamp=stamp, frame_id="eye", data=data, format=FORMATS[codec])
    header = SimpleNamespace(stamp=stamp, frame_id="eye")
    if kind == FFMPEG_PACKET:
        encoding = f"{codec};yuv420p;bgr8;bgr8"
        return SimpleNamespace(
            header=header, encoding=encoding, pts=packet.number, flags=int(packet.key), data=data
        )
    return SimpleNamespace(header=header, format=FORMATS[codec], data=data)


def decoded(packets: list[Encoded], kind: str, codec: str) -> dict[int, Any]:
    """By the picture's number what became of its message: the number shown, or the reason."""
    decoder = PictureDecoder(kind, "/camera")
    outcomes = [o for p in packets for o in decoder.take(message_of(p, kind, codec))]
    outcomes += decoder.finish()
    assert sorted(outcome.ordinal for outcome in outcomes) == list(range(len(packets)))
    found: dict[int, Any] = {}
    for outcome in outcomes:
        number = packets[outcome.ordinal].number
        if outcome.picture is None:
            found[number] = outcome.reason
        else:
            assert outcome.picture.stamp_ns == number * 1_000_000_000 + 5
            assert outcome.picture.frame == "eye"
            found[number] = number_in(outcome.picture.rgb)
    return found


def exactly(numbers: Any) -> dict[int, Any]:
    return {number: pytest.approx(number, abs=0.3) for number in numbers}


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("kind", [*KINDS, "sensor_msgs/msg/CompressedImage"])
def test_every_message_gives_its_own_picture(codec: str, kind: str) -> None:
    assert decoded(encode(codec), kind, codec) == exactly(range(24))


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("b_frames", [1, 2, 3])
def test_b_frames_are_matched_to_their_messages(codec: str, b_frames: int) -> None:
    packets = encode(codec, b_frames=b_frames)
    assert [p.number for p in packets] != sorted(p.number for p in packets)
    assert decoded(packets, FFMPEG_PACKET, codec) == exactly(range(24))


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("first", [1, 5, 7])
def test_a_recording_that_begins_in_mid_stream_waits_for_a_key_frame(
    codec: str, kind: str, first: int
) -> None:
    found = decoded(encode(codec)[first:], kind, codec)
    early = dict.fromkeys(range(first, 8), BEFORE_KEY_FRAME)
    assert found == early | exactly(range(8, 24))


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("lost", [[9], [10, 11], [15], [12, 13, 14]])
def test_after_a_lost_packet_there_is_no_picture_until_the_next_key_frame(
    codec: str, kind: str, lost: list[int]
) -> None:
    packets = [packet for packet in encode(codec) if packet.number not in lost]
    found = decoded(packets, kind, codec)
    after = range(lost[-1] + 1, 16)
    assert all(found.pop(number) in (PACKET_LOST, DAMAGED) for number in after)
    assert found == exactly([*range(lost[0]), *range(16, 24)])


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_lost_key_frame_costs_its_whole_group(codec: str, kind: str) -> None:
    found = decoded([p for p in encode(codec) if p.number != 8], kind, codec)
    assert not any(isinstance(found.pop(number), float) for number in range(9, 16))
    assert found == exactly([*range(8), *range(16, 24)])


@pytest.mark.parametrize("codec", CODECS)
@settings(deadline=None, max_examples=25)
@given(lost=st.sets(st.integers(0, 23), max_size=6), b_frames=st.sampled_from([0, 2]))
def test_whatever_is_lost_a_picture_is_its_own_or_none(
    codec: str, lost: set[int], b_frames: int
) -> None:
    packets = [p for p in encode(codec, b_frames=b_frames) if p.number not in lost]
    for number, shown in decoded(packets, COMPRESSED_VIDEO, codec).items():
        assert isinstance(shown, str) or shown == pytest.approx(number, abs=0.6)


def test_a_gap_in_pts_is_a_loss_where_the_stream_does_not_tell() -> None:
    packets = encode("h264", count=8)
    decoder = VideoDecoder(FFMPEG_PACKET, "/camera")
    messages = [message_of(packet, FFMPEG_PACKET, "h264") for packet in packets]
    for message in messages[4:]:
        message.pts += 1
    outcomes = [outcome for message in messages for outcome in decoder.take(message)]
    assert [o.reason for o in outcomes] == [""] * 4 + [PACKET_LOST] * 4
    assert "/camera, stamp 4.000000005" in outcomes[4].detail


def test_pts_that_are_times_are_no_count_of_packets() -> None:
    decoder = VideoDecoder(FFMPEG_PACKET, "/camera")
    messages = [message_of(packet, FFMPEG_PACKET, "h264") for packet in encode("h264")]
    times = np.cumsum([33, 34, 33, 67, 33, 100] * 4).tolist()
    for message, pts in zip(messages, times, strict=True):
        message.pts = pts
    outcomes = [outcome for message in messages for outcome in decoder.take(message)]
    assert all(outcome.picture is not None for outcome in outcomes)


def test_parameter_sets_may_come_in_a_message_of_their_own() -> None:
    first, *others = encode("h264", count=6)
    slice_at = first.data.rindex(b"\x00\x00\x01\x65")
    parted = [Encoded(90, False, first.data[:slice_at]), Encoded(0, True, first.data[slice_at:])]
    found = decoded([*parted, *others], COMPRESSED_VIDEO, "h264")
    assert found.pop(90) == NO_PICTURE
    assert found == exactly(range(6))


def test_a_packet_that_is_cut_closes_the_stream() -> None:
    packets = encode("h264")
    packets[10] = packets[10]._replace(data=packets[10].data[: len(packets[10].data) // 2])
    found = decoded(packets, COMPRESSED_VIDEO, "h264")
    assert {found.pop(number) for number in range(10, 16)} == {DAMAGED}
    assert found == exactly([*range(10), *range(16, 24)])


@pytest.mark.parametrize(
    ("changes", "reason", "detail"),
    [
        ({"format": "av1"}, DAMAGED, "format 'av1' is not read; expected h264 or h265"),
        ({"data": np.array([0, 0, 0, 9, 65], np.uint8)}, DAMAGED, "only Annex B"),
        ({"data": np.zeros(0, np.uint8)}, DAMAGED, "0 bytes without a start code"),
        ({"timestamp": None}, DAMAGED, "fields are not those"),
    ],
)
def test_what_is_no_video_is_named(changes: dict[str, Any], reason: str, detail: str) -> None:
    message = message_of(encode("h264", count=1)[0], COMPRESSED_VIDEO, "h264")
    for name, value in changes.items():
        setattr(message, name, value)
    (outcome,) = VideoDecoder(COMPRESSED_VIDEO, "/camera").take(message)
    assert outcome.picture is None
    assert outcome.reason == reason
    assert detail in outcome.detail


@pytest.mark.parametrize("encoding", ["libx264", "h264_nvenc", "h264_vaapi", "hevc_nvenc"])
def test_older_packets_name_their_encoder(encoding: str) -> None:
    codec = "hevc" if "hevc" in encoding else "h264"
    message = message_of(encode(codec, count=1)[0], FFMPEG_PACKET, codec)
    message.encoding = encoding
    (outcome,) = VideoDecoder(FFMPEG_PACKET, "/camera").take(message)
    assert outcome.picture is not None


@settings(deadline=None, max_examples=60)
@given(
    codec=st.sampled_from(CODECS),
    changes=st.lists(st.tuples(st.integers(0, 23), st.integers(0, 5000), st.integers(0, 255))),
)
def test_damaged_bytes_give_an_outcome_for_every_message(
    codec: str, changes: list[tuple[int, int, int]]
) -> None:
    packets = encode(codec)
    for which, position, value in changes:
        data = bytearray(packets[which].data)
        data[position % len(data)] = value
        packets[which] = packets[which]._replace(data=bytes(data))
    decoded(packets, COMPRESSED_VIDEO, codec)


def test_pictures_that_nobody_wants_are_not_made() -> None:
    decoder = PictureDecoder(COMPRESSED_VIDEO, "/camera")
    outcomes = [
        outcome
        for packet in encode("h264", count=9)
        for outcome in decoder.take(
            message_of(packet, COMPRESSED_VIDEO, "h264"), wanted=packet.number == 6
        )
    ]
    assert [outcome.ordinal for outcome in outcomes] == [6]
    assert outcomes[0].picture is not None
    assert number_in(outcomes[0].picture.rgb) == pytest.approx(6, abs=0.3)
