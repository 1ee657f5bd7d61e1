"""Numbered files: parts of one recording where they go on, recordings where they do not."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations
from pathlib import Path
from typing import Any

import pytest
import zstandard

from graspe_data.errors import RecordingError
from graspe_data.recordings import open_recording, recording_digest
from graspe_data.recordings.containers.ends import read_ends
from graspe_data.recordings.discovery import find_recordings
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.parts import join_parts
from graspe_data.recordings.writing import Container

CLASSES: Any = message_classes()
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
CONTAINERS: tuple[Container, ...] = ("bag", "db3", "mcap")
Part = Callable[..., Path]


def count(path: Path) -> int:
    with open_recording(path) as recording:
        return sum(1 for _ in recording.messages())


@pytest.mark.parametrize("container", CONTAINERS)
@pytest.mark.parametrize("width", [1, 2, 4])
def test_parts_that_go_on_are_one_recording_whichever_is_named(
    part: Part, container: Container, width: int
) -> None:
    files = [part(f"run_{n:0{width}}", 5 * n, container=container) for n in range(3)]
    whole = files[0] if container == "bag" else files[0].parent
    for order in permutations(files):
        assert find_recordings(order) == [whole]
    assert find_recordings([files[0].parent]) == [whole]
    for file in files:
        assert find_recordings([file]) == [whole]
        assert recording_digest(file) == recording_digest(whole)
        assert count(file) == 150
    with open_recording(whole) as recording:
        assert recording.files == files
        assert recording.losses == []
        times = [raw.bag_time_ns for raw in recording.messages()]
        assert times == sorted(times)


def test_the_time_in_the_name_of_a_ros1_part_is_that_of_the_part(part: Part) -> None:
    dates = ("2024-01-01-10-00-05", "2024-01-01-10-00-010", "2024-01-01-10-00-15")
    files = [part(f"site_{date}_{n}", 5 * n) for n, date in enumerate(dates)]
    again = [part(f"site_2024-01-02-09-00-0{5 * n}_{n}", 9000 + 5 * n) for n in range(2)]
    bare = [part(f"{date}_{n}", 5 * n) for n, date in enumerate(dates)]
    assert find_recordings([files[0].parent]) == sorted([files[0], again[0], bare[0]])
    assert [len(parts.files) for parts in join_parts(files + again)] == [3, 2]


@pytest.mark.parametrize("container", CONTAINERS)
@pytest.mark.parametrize("start_s", [6.1, 60.0, 86_400.0, 0.0, -3.0, 3.5, -86_400.0])
def test_numbered_runs_that_do_not_go_on_are_several_recordings(
    part: Part, container: Container, start_s: float
) -> None:
    one = part("run_1", 0, container=container)
    two = part("run_2", start_s, container=container)
    assert find_recordings([one.parent]) == [one, two]
    assert find_recordings([two]) == [two]
    assert count(one) == count(two) == 50
    assert recording_digest(one) != recording_digest(two)
    with pytest.raises(RecordingError, match=r"2 recordings, .*run_1.*run_2.*Name one of them"):
        open_recording(one.parent)


@pytest.mark.parametrize("start_s", [4.2, 4.9, 5.0, 5.8])
def test_a_second_between_parts_is_no_gap(part: Part, start_s: float) -> None:
    files = [part("run_0", 0), part("run_1", start_s)]
    assert find_recordings(files) == files[:1]


def test_very_short_runs_that_begin_again_are_no_parts(part: Part) -> None:
    files = [part("run_0", 0, length_s=0.5), part("run_1", 0, length_s=0.5)]
    assert find_recordings(files) == files


@pytest.mark.parametrize(
    ("one", "two"), [("2023-05-01", "2023-05-02"), ("site12", "site13"), ("a_0", "b_1")]
)
def test_names_that_are_no_parts_stay_apart_though_times_go_on(
    part: Part, one: str, two: str
) -> None:
    files = [part(one, 0), part(two, 5)]
    assert find_recordings([files[0].parent]) == files


def test_runs_with_names_of_their_own_in_one_folder_are_told_apart(part: Part) -> None:
    ours = [part(f"ours_{n}", 5 * n, container="mcap") for n in range(2)]
    theirs = [part(f"theirs_{n}", 5 * n, container="mcap") for n in range(2)]
    assert find_recordings([ours[0].parent]) == [ours[0], theirs[0]]
    assert find_recordings([ours[1]]) == [ours[0]]
    assert count(theirs[1]) == 100


def test_a_topic_of_another_type_is_another_recording(part: Part) -> None:
    one = part("run_0", 0)
    two = part("run_1", 5, message=lambda _: CLASSES["std_msgs/msg/Header"](_time(), "frame"))
    three = part("run_2", 10, topic="/others")
    assert find_recordings([one.parent]) == [one, two]
    assert len(join_parts([one, two, three])[1].files) == 2


def _time() -> object:
    return CLASSES["builtin_interfaces/msg/Time"](0, 0)


def test_an_empty_part_goes_on(part: Part) -> None:
    files = [part("run_0", 0), part("run_1", 0, length_s=0), part("run_2", 5)]
    assert read_ends(files[1]).empty
    assert find_recordings([files[2]]) == files[:1]
    assert count(files[1]) == 100


@pytest.mark.parametrize("container", CONTAINERS)
def test_a_missing_part_is_a_named_loss(part: Part, container: Container) -> None:
    files = [part(f"run_{n}", 5 * n, container=container) for n in (0, 2, 3)]
    with open_recording(files[0]) as recording:
        assert recording.files == files
        [loss] = recording.losses
    assert f"1 part missing between run_0.{container} and run_2.{container}: 5.1 s" in loss.reason


def test_a_gap_longer_than_the_missing_part_can_be_is_no_missing_part(part: Part) -> None:
    files = [part("run_0", 0), part("run_2", 30), part("run_3", 35)]
    assert find_recordings(files) == files[:2]
    assert count(files[2]) == 100


def test_missing_parts_are_believed_only_of_numbers_that_begin_at_0(part: Part) -> None:
    files = [part("run_1", 0), part("run_3", 10)]
    assert find_recordings(files) == files


def test_the_last_part_may_still_be_open(part: Part) -> None:
    files = [part("run_0", 0), part("run_1", 5)]
    whole = files[1].read_bytes()
    active = files[1].with_name("run_1.bag.active")
    active.write_bytes(whole[: len(whole) - 100])
    files[1].unlink()
    assert find_recordings([active]) == [files[0]]
    assert count(files[0]) >= 50
    later = part("run_2", 500)
    assert find_recordings([later]) == [later] or "damaged" in str(_losses(later))


def _losses(path: Path) -> list[str]:
    with open_recording(path) as recording:
        return [loss.reason for loss in recording.losses]


@pytest.mark.parametrize("container", CONTAINERS)
@pytest.mark.parametrize("first", [0, 1])
def test_a_cut_part_is_taken_by_its_number_where_that_begins_at_0(
    part: Part, container: Container, first: int
) -> None:
    files = [part(f"run_{first + n}", 5 * n, container=container) for n in range(2)]
    content = files[0].read_bytes()
    files[0].write_bytes(content[: len(content) // 2])
    assert read_ends(files[0]).stop_ns is None
    if first == 0:
        whole = files[0] if container == "bag" else files[0].parent
        assert find_recordings(files) == [whole]
        assert any("by its number alone" in reason for reason in _losses(whole))
    else:
        assert find_recordings(files) == files


def test_parts_that_are_compressed_as_a_whole_are_joined(part: Part) -> None:
    files = [part(f"run_{n}", 5 * n, container="db3") for n in range(3)]
    packed = []
    for file in files[:2]:
        packed.append(file.with_name(f"{file.name}.zstd"))
        packed[-1].write_bytes(zstandard.compress(file.read_bytes()))
        file.unlink()
    assert find_recordings([packed[1]]) == [packed[0].parent]
    assert count(packed[1]) == 150


def test_a_compressed_twin_is_no_part(part: Part) -> None:
    file = part("run_0", 0, container="mcap")
    twin = file.with_name("run_0.mcap.zstd")
    twin.write_bytes(zstandard.compress(file.read_bytes()))
    assert find_recordings([file.parent]) == [file, twin]


def test_a_listed_part_leads_to_its_folder(tmp_path: Path, part: Part) -> None:
    files = [part(f"run_{n}", 500 * n, container="db3") for n in range(2)]
    listed = "\n".join(f"  - {file.name}" for file in files)
    text = f"rosbag2_bagfile_information:\n  relative_file_paths:\n{listed}\n"
    (files[0].parent / "metadata.yaml").write_text(text)
    assert find_recordings([files[1]]) == [files[0].parent]
    assert recording_digest(files[1]) == recording_digest(files[0].parent)
    assert count(files[1]) == 100


@pytest.mark.parametrize(
    ("folder", "files", "messages"),
    [
        ("rosbag2_message_compression", 4, 1127),
        ("rosbag2_file_compression", 4, 775),
        ("rosbag2_wbag_mcap_zstd", 5, 6074),
    ],
)
def test_real_splits_are_one_recording(
    recordings: Path, folder: str, files: int, messages: int
) -> None:
    assert find_recordings([recordings / folder]) == [recordings / folder]
    with open_recording(recordings / folder) as recording:
        assert len(recording.files) == files
        assert sum(1 for _ in recording.messages()) == messages
        assert recording.losses == []
