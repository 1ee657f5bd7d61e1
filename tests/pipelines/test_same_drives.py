"""Recordings of one drive count once, or stay on one side of the split."""

from __future__ import annotations

import hashlib
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.recordings import RecordingWriter, open_recording, recording_digest
from graspe_data.recordings.content import ContentIdentity
from graspe_data.recordings.writing import Container
from graspe_data.shards.dataset_manifest import RecordingEntry
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.synchronisation.first_pass import read_tracks
from pipelines.build import BuildResult, build_dataset
from pipelines.dataset_settings import DatasetRecipe, Group, SplitSettings
from pipelines.executors import Workers
from pipelines.progress import Silent
from pipelines.same_drives import Drive, find_links
from pipelines.splits import Placement, place_recordings
from tests.pipelines.conftest import LEGS, RecordingFactory
from tests.pipelines.file_digests import file_digests

THIRDS = SplitSettings(train=0.5, validation=0.25, test=0.25)
SECOND = 1_000_000_000


def sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def measured(number: int, start: int, stop: int) -> ContentIdentity:
    """The content of some seconds of a drive, three fingerprints a second of each sensor."""
    prints = tuple(sorted(1000 * number + n for n in range(3 * start, 3 * stop)))
    return ContentIdentity(
        digest=sha(f"{number} {start} {stop}"),
        begin_ns=start * SECOND,
        end_ns=stop * SECOND,
        fingerprints={"image": prints, "points": tuple(5 * 10**6 + one for one in prints)},
    )


def drive(name: str, number: int, start: int = 0, stop: int = 60) -> Drive:
    return Drive(name, sha(name), measured(number, start, stop))


def placed(
    drives: list[Drive], settings: SplitSettings = THIRDS, seed: int = 0
) -> dict[str, Placement]:
    found = place_recordings(drives, settings, seed)
    return {
        one.name: place
        for one, place in zip(drives, found, strict=True)
        if isinstance(place, Placement)
    }


def test_an_overlap_is_in_one_group_whatever_the_seed() -> None:
    cuts = [drive("a", 1, 0, 40), drive("b", 1, 35, 70), drive("c", 1, 65, 99), drive("d", 2)]
    sides = set()
    for seed in range(200):
        found = placed(cuts, seed=seed)
        assert len({found[name].split for name in "abc"}) == 1
        sides.add((found["a"].split, found["d"].split))
    assert len(sides) == 9
    assert found["b"].linked == ("a", "c")
    assert {found[name].group for name in "abc"} == {min(d.identity for d in cuts[:3])[:12]}


def test_the_other_recordings_move_no_draw_but_of_what_overlaps_them() -> None:
    alone, other, cut = drive("a", 1), drive("b", 2), drive("c", 3, 0, 10)
    for seed in range(50):
        assert placed([alone], seed=seed)["a"] == placed([cut, other, alone], seed=seed)["a"]


@given(st.permutations(range(6)), st.integers(0, 1000))
def test_the_order_of_the_recordings_does_not_count(order: list[int], seed: int) -> None:
    drives = [
        drive("a", 1, 0, 40),
        drive("b", 1, 30, 60),
        drive("x", 2, 0, 20),
        drive("y", 2, 10, 30),
        drive("z", 2, 25, 40),
        drive("alone", 3),
    ]
    settings = THIRDS.model_copy(
        update={
            "groups": (
                Group(name="one", recordings=("x",), split="train"),
                Group(name="two", recordings=("z",), split="test"),
            )
        }
    )
    assert placed([drives[n] for n in order], settings, seed) == placed(drives, settings, seed)


def test_a_declared_group_takes_what_overlaps_it() -> None:
    groups = (Group(name="yard", recordings=("a*",), split="test"),)
    settings = THIRDS.model_copy(update={"groups": groups})
    found = placed([drive("a1", 1, 0, 30), drive("b", 1, 20, 50), drive("a2", 2)], settings)
    assert {name: (place.group, place.split) for name, place in found.items()} == {
        "a1": ("yard", "test"),
        "b": ("yard", "test"),
        "a2": ("yard", "test"),
    }


def test_groups_that_overlap_are_drawn_together() -> None:
    groups = (Group(name="yard", recordings=("a*",)), Group(name="field", recordings=("b*",)))
    settings = THIRDS.model_copy(update={"groups": groups})
    drives = [drive("a1", 1, 0, 30), drive("b1", 1, 20, 50), drive("a2", 2), drive("b2", 3)]
    for seed in range(100):
        found = placed(drives, settings, seed)
        assert len({place.split for place in found.values()}) == 1
    assert found["a2"].group == "yard"
    assert found["b2"].group == "field"


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_declared_groups_that_tear_an_overlap_refuse_the_later_name(order: tuple[int, ...]) -> None:
    groups = (
        Group(name="yard", recordings=("b",), split="train"),
        Group(name="field", recordings=("c",), split="test"),
    )
    settings = THIRDS.model_copy(update={"groups": groups})
    drives = [drive("b", 1, 0, 30), drive("c", 1, 20, 50), drive("a", 2)]
    given_drives = [drives[n] for n in order]
    found = place_recordings(given_drives, settings, seed=0)
    reason = found[given_drives.index(drives[1])]
    assert isinstance(reason, str)
    assert reason == (
        "c: holds the same measurements as b, but the declared groups field (test) and yard "
        "(train) put them in different splits. List both recordings in one group under "
        "split.groups, or leave one of them out."
    )
    assert set(placed(given_drives, settings)) == {"a", "b"}


def test_what_lies_between_two_declared_groups_is_what_is_refused() -> None:
    groups = (
        Group(name="yard", recordings=("x",), split="train"),
        Group(name="field", recordings=("y",), split="test"),
    )
    settings = THIRDS.model_copy(update={"groups": groups})
    drives = [drive("a", 1, 20, 50), drive("x", 1, 0, 30), drive("y", 1, 40, 70)]
    found = place_recordings(drives, settings, seed=0)
    assert isinstance(found[0], str)
    assert "a: holds the same measurements as" in found[0]
    assert set(placed(drives, settings)) == {"x", "y"}


def numbered(name: str, start: int, stop: int, files: tuple[str, ...] = ()) -> Drive:
    content = ContentIdentity(digest=sha(name), begin_ns=start * SECOND, end_ns=stop * SECOND)
    return Drive(name, sha(name), content, files or (name,))


@pytest.mark.parametrize(
    ("drives", "links"),
    [
        ([numbered("run_0.bag", 0, 9), numbered("run_2.bag", 99, 108)], 1),
        ([numbered("run_0.bag", 0, 9), numbered("run_1.bag", 99, 108)], 0),
        ([numbered("run_1.bag", 0, 9), numbered("run_3.bag", 99, 108)], 0),
        ([numbered("run_0.bag", 0, 9), numbered("run_1.bag", 9, 18)], 1),
        ([numbered("run_0.bag", 0, 9), numbered("run_1.bag", -50, -41)], 0),
        ([numbered("run_0.bag", 0, 9), numbered("walk_2.bag", 99, 108)], 0),
        ([numbered("2024-05-01.bag", 0, 9), numbered("2024-05-02.bag", 9, 18)], 0),
        ([numbered("r", 0, 9, ("r_0.db3", "r_1.db3")), numbered("r_3.db3", 99, 108)], 1),
        ([numbered("r", 0, 9, ("r_0.db3", "r_1.db3")), numbered("r_2.db3", 99, 108)], 0),
    ],
)
def test_recordings_between_which_a_part_is_missing_stay_together(
    drives: list[Drive], links: int
) -> None:
    assert len(find_links(drives)) == links
    assert len(find_links(drives[::-1])) == links


def build(
    recipe: DatasetRecipe,
    recordings: list[Path],
    out: Path,
    workers: int = 1,
    **dataset: object,
) -> BuildResult:
    changed = recipe.dataset.model_copy(update=dataset)
    recipe = recipe.model_copy(update={"dataset": changed})
    return build_dataset(recipe, recordings, out, Workers(workers), Silent())


def entries(result: BuildResult) -> dict[str, RecordingEntry]:
    return {entry.name: entry for entry in result.index.recordings}


def cut(recording: Path, path: Path, container: Container, start_s: float, stop_s: float) -> Path:
    """Some seconds of a recording, with its fixed transforms."""
    with open_recording(recording) as source, RecordingWriter(path, container) as writer:
        raws = list(source.messages())
        zero = min(raw.bag_time_ns for raw in raws)
        for raw in raws:
            second = (raw.bag_time_ns - zero) / SECOND
            if start_s <= second < stop_s or raw.topic == "/tf_static":
                writer.write(raw.topic, source.decode(raw), raw.bag_time_ns)
    return path


def test_six_drives_four_of_them_in_two_containers(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    twice = [(f"twin{n}", container, n) for n in range(4) for container in ("bag", "db3")]
    given_recordings = [record(f"{name}_{c}", c, seed=n) for name, c, n in twice]  # type: ignore[arg-type]
    given_recordings += [record("one", seed=4), record("two", seed=5)]
    result = build(recipe, given_recordings, tmp_path / "out", split=THIRDS)
    counted = [entry for entry in result.index.recordings if entry.rows]
    assert len(counted) == 6
    assert len({entry.group for entry in counted}) == 6
    for refusal in result.refused:
        name, twin = refusal.path.name, refusal.counted_as
        assert name.split("_")[0] == twin.split("_")[0]
        expected = f"{name}: the same drive as {twin}, in another container; it counts once."
        assert refusal.reason == expected
    assert len(result.refused) == 4
    again = build(recipe, given_recordings[::-1], tmp_path / "two", workers=2, split=THIRDS)
    assert file_digests(tmp_path / "out") == file_digests(tmp_path / "two")
    assert again.index.dataset_digest == result.index.dataset_digest
    groups: dict[str, set[tuple[str, str | None]]] = {}
    for recordings in (given_recordings[::2], given_recordings[1::2]):
        found = build(recipe, recordings, tmp_path / recordings[0].name, split=THIRDS)
        for entry in found.index.recordings:
            groups.setdefault(entry.name.split("_")[0], set()).add((entry.group, entry.split))
    assert all(len(found) == 1 for found in groups.values())


def test_no_drive_is_on_two_sides_for_any_seed(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recordings = [record(f"drive{n}_{c}", c, seed=n) for n in range(2) for c in ("bag", "mcap")]
    longer = record("long", legs=(*LEGS, Leg(3.0, 0.5, 0.0)), seed=2)
    recordings += [
        cut(longer, tmp_path / "cut_a", "db3", 0, 6.5),
        cut(longer, tmp_path / "cut_b.bag", "bag", 3, 9.5),
    ]
    drives = []
    for path in recordings:
        with open_recording(path) as recording:
            content = read_tracks(recording, recipe.robot).content
        drives.append(Drive(path.name, recording_digest(path), content))
    of_one_drive = [("drive0_bag.bag", "drive0_mcap"), ("drive1_bag.bag", "drive1_mcap")]
    for seed in range(200):
        found = placed(drives, seed=seed)
        for one, other in [*of_one_drive, ("cut_a", "cut_b.bag")]:
            assert found[one].split == found[other].split
    kept = entries(build(recipe, recordings, tmp_path / "out", split=THIRDS))
    assert kept["cut_a"].details["overlaps"] == ["cut_b.bag"]
    assert kept["cut_b.bag"].details["overlaps"] == ["cut_a"]
    assert kept["cut_a"].group == kept["cut_b.bag"].group
    assert kept["cut_a"].rows > 0
    assert kept["cut_b.bag"].rows > 0
    assert len({entry.group for entry in kept.values() if entry.rows}) == 3


def test_the_one_that_counts_is_the_one_that_a_person_labelled_or_declared(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    pair = [record("a", "bag"), record("a", "db3")]
    for number, name in enumerate(("a.bag", "a")):
        split = SplitSettings(groups=(Group(name="g", recordings=(name,), split="test"),))
        found = entries(build(recipe, pair, tmp_path / str(number), split=split))
        assert found[name].split == "test"
        assert sum(entry.rows > 0 for entry in found.values()) == 1


def test_parts_of_a_split_are_one_recording_of_the_dataset(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    whole = record("whole")
    folder = tmp_path / "parts"
    folder.mkdir()
    ends = ((0, 2.5), (2.5, 4.5), (4.5, 99))
    for number, (start, stop) in enumerate(ends):
        _part(whole, folder / f"drive_{number}.bag", start, stop)
    split = SplitSettings(train=1, validation=0, test=0)
    one = build(recipe, [whole], tmp_path / "one", split=split)
    parts = build(recipe, [folder / "drive_0.bag"], tmp_path / "two", split=split)
    assert parts.index.rows("train") == one.index.rows("train") > 0
    entry = entries(parts)["drive_0.bag"]
    assert entry.details["files"] == ["drive_0.bag", "drive_1.bag", "drive_2.bag"]
    assert entry.group == one.index.recordings[0].group
    assert entry.details["content"] == one.index.recordings[0].details["content"]


def _part(recording: Path, path: Path, start_s: float, stop_s: float) -> None:
    """As ``rosbag record --split`` leaves it: fixed transforms in the first part alone."""
    with open_recording(recording) as source, RecordingWriter(path, "bag") as writer:
        raws = list(source.messages())
        zero = min(raw.bag_time_ns for raw in raws)
        for raw in raws:
            if start_s <= (raw.bag_time_ns - zero) / SECOND < stop_s:
                writer.write(raw.topic, source.decode(raw), raw.bag_time_ns)


def test_the_links_are_those_of_every_pair_tried() -> None:
    random = np.random.default_rng(0)
    drives = []
    for number in range(40):
        start = int(random.integers(0, 300))
        drives.append(drive(f"d{number}", number % 5, start, start + int(random.integers(1, 40))))
    pairs = {
        (one, other)
        for one in range(40)
        for other in range(one + 1, 40)
        if drives[one].content.overlaps(drives[other].content)
    }
    assert {(link.one, link.other) for link in find_links(drives)} == pairs
    assert pairs
