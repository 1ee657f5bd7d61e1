"""The identity by content: the same in any container, another for another drive."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.convert import convert

from graspe_data.recordings import open_recording
from graspe_data.recordings.identity import (
    KEPT,
    ContentIdentity,
    ContentObserver,
    Kind,
    mix_stamp,
)
from graspe_data.recordings.messages import RawMessage
from graspe_data.recordings.writing import COMPRESSIONS, Compression, Container
from tests.graspe_data.recordings.small_drives import (
    CLASSES,
    SECOND,
    START,
    TOPICS,
    Message,
    between,
    drive,
    header,
    write,
)


def identity(path: Path, prefix: str = "") -> ContentIdentity:
    with open_recording(path) as recording:
        types = {topic.name: topic.message_type for topic in recording.topics.values()}
        kinds = {prefix + topic: kind for topic, kind in TOPICS.items()}
        observer = ContentObserver(recording.decode, kinds, types)
        for raw in recording.messages():
            observer.observe(raw, recording.header_stamp_ns(raw))
        return observer.result()


@pytest.fixture
def known(tmp_path: Path) -> Callable[..., ContentIdentity]:
    """The identity of some messages, written to an MCAP."""
    folder = iter(range(1000))

    def of(messages: Iterable[Message], prefix: str = "") -> ContentIdentity:
        path = write(tmp_path / f"known{next(folder)}", messages, prefix=prefix)
        return identity(path, prefix)

    return of


Known = Callable[[Iterable[Message]], ContentIdentity]


@pytest.mark.parametrize(
    ("container", "compression"),
    [(container, one) for container, several in COMPRESSIONS.items() for one in several],
)
def test_every_container_has_the_same_identity(
    tmp_path: Path, known: Known, container: Container, compression: Compression
) -> None:
    messages = drive()
    path = tmp_path / ("other.bag" if container == "bag" else "other")
    found = identity(write(path, messages, container, compression))
    assert found == known(messages)
    assert found.digest


def test_what_rosbags_converts_keeps_its_identity(tmp_path: Path) -> None:
    bag = write(tmp_path / "drive.bag", drive(), "bag")
    convert(
        srcs=[bag],
        dst=tmp_path / "converted",
        dst_storage="sqlite3",
        dst_version=8,
        compress=None,
        compress_mode="none",
        default_typestore=None,
        typestore=None,
        exclude_topics=(),
        include_topics=(),
        exclude_msgtypes=(),
        include_msgtypes=(),
    )
    assert identity(tmp_path / "converted") == identity(bag)


def test_the_order_in_the_file_and_the_names_of_the_topics_do_not_count(
    tmp_path: Path, known: Callable[..., ContentIdentity]
) -> None:
    messages = drive()
    backwards = identity(write(tmp_path / "backwards.bag", messages[::-1], "bag"))
    assert backwards == known(messages)
    assert known(messages, prefix="/robot7") == known(messages)


def test_another_drive_with_the_same_stamps_is_another(known: Known) -> None:
    one, other = known(drive(0)), known(drive(1))
    assert one.digest != other.digest
    assert not one.overlaps(other)


def test_only_odometry_tells_two_drives_apart_in_the_dark(known: Known) -> None:
    one, other = (known(drive(0, speed, dark=True, same_clouds=True)) for speed in (0.6, 0.7))
    assert "image" not in one.fingerprints
    assert one.digest != other.digest
    assert not one.overlaps(other)


def test_equal_pictures_alone_are_no_overlap_and_equal_clouds_alone_neither(known: Known) -> None:
    one = known(drive(0, same_pictures=True))
    assert not one.overlaps(known(drive(1, 0.7, same_pictures=True)))
    two = known(drive(0, same_clouds=True))
    assert not two.overlaps(known(drive(1, 0.7, same_clouds=True)))


@pytest.mark.parametrize("changed", ["/camera", "/lidar"])
def test_a_copy_whose_pictures_or_clouds_were_written_anew_is_the_same_drive(
    known: Known, changed: str
) -> None:
    first, other = drive(0), drive(1)
    kept = [message for message in first if message[0] != changed]
    anew = [message for message in other if message[0] == changed]
    copy = sorted([*kept, *anew], key=lambda message: message[1])
    one, two = known(first), known(copy)
    assert one.digest != two.digest
    assert one.overlaps(two)
    assert two.overlaps(one)


def test_corrected_odometry_leaves_it_the_same_drive(known: Known) -> None:
    one, other = known(drive(0, 0.6)), known(drive(0, 0.61))
    assert one.digest != other.digest
    assert one.overlaps(other)


def test_two_drives_in_the_dark_with_nothing_to_see_have_no_identity(known: Known) -> None:
    messages = [message for message in drive(0, dark=True) if message[0] != "/lidar"]
    assert known(messages).digest == ""
    assert not known(messages).overlaps(known(messages))


@pytest.mark.parametrize(("start_s", "stop_s"), [(0, 6), (6, 12), (3, 8), (8, 12)])
def test_a_cut_overlaps_its_whole_and_is_another(
    known: Known, start_s: float, stop_s: float
) -> None:
    whole, cut = known(drive()), known(between(drive(), start_s, stop_s))
    assert whole.digest != cut.digest
    assert whole.overlaps(cut)
    assert cut.overlaps(whole)


def test_two_cuts_overlap_where_they_share_seconds_and_else_not(known: Known) -> None:
    first, second, third = (known(between(drive(), *ends)) for ends in ((0, 7), (4, 12), (7.2, 12)))
    assert first.overlaps(second)
    assert not first.overlaps(third)


def test_one_cloud_less_is_another_identity(known: Known) -> None:
    messages = drive()
    chosen = next(m for m in messages if m[0] == "/lidar" and not mix_stamp(_stamp(m)) % 4)
    shorter = [message for message in messages if message is not chosen]
    assert known(shorter).digest != known(messages).digest


def _stamp(message: Message) -> int:
    content: Any = message[2]
    stamp = content.header.stamp
    return int(stamp.sec) * SECOND + int(stamp.nanosec)


def test_damaged_messages_are_passed_over(tmp_path: Path) -> None:
    path = write(tmp_path / "drive", drive())
    with open_recording(path) as recording:
        types = {topic.name: topic.message_type for topic in recording.topics.values()}
        observer = ContentObserver(recording.decode, TOPICS, types)
        for raw in recording.messages():
            cut = RawMessage(raw.topic, raw.bag_time_ns, raw.data[:40])
            observer.observe(cut, recording.header_stamp_ns(cut))
        assert observer.result().digest == ""


@given(st.integers(1, 10**9), st.integers(0, 10**18))
def test_of_any_period_about_one_in_four_stamps_is_chosen(period: int, phase: int) -> None:
    chosen = sum(mix_stamp(phase + n * period) % 4 == 0 for n in range(1000))
    assert 170 < chosen < 330


def test_a_long_recording_keeps_a_bounded_number_and_still_overlaps_its_cuts() -> None:
    random = np.random.default_rng(0)
    messages = {n: random.integers(0, 256, 400, np.uint8) for n in range(30_000)}

    def found(numbers: Iterable[int]) -> ContentIdentity:
        picture = CLASSES["sensor_msgs/msg/Image"]

        def decode(raw: RawMessage) -> object:
            number = (raw.bag_time_ns - START) * 10 // SECOND
            return picture(header(raw.bag_time_ns), 1, 400, "mono8", 0, 400, messages[number])

        kinds: dict[str, Kind] = {"/camera": "image", "/lidar": "points"}
        observer = ContentObserver(decode, kinds, {})
        for number in numbers:
            for topic in kinds:
                stamp = START + number * SECOND // 10
                observer.observe(RawMessage(topic, stamp, b""), stamp)
        return observer.result()

    whole, cut = found(range(30_000)), found(range(20_000, 20_600))
    assert len(whole.fingerprints["image"]) == KEPT
    assert whole.overlaps(cut)
