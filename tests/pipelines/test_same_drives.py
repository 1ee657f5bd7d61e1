"""Recordings of one drive count once, or stay on one side of the split."""

from __future__ import annotations

from pathlib import Path

from graspe_data.progress import Silent
from graspe_data.recordings import RecordingWriter, open_recording, recording_digest
from graspe_data.recordings.writing import Container
from graspe_data.shards.dataset_index import RecordingEntry
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.synchronisation.first_pass import read_tracks
from pipelines.build import BuildResult, build_dataset
from pipelines.dataset_settings import DatasetRecipe, Group, SplitSettings
from pipelines.executors import Workers
from pipelines.same_drives import DriveIdentity
from pipelines.splits import SplitPlacement, place_recordings
from tests.pipelines.conftest import LEGS, RecordingFactory
from tests.pipelines.file_digests import file_digests

THIRDS = SplitSettings(train=0.5, validation=0.25, test=0.25)
SECOND = 1_000_000_000


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
        drives.append(DriveIdentity(path.name, recording_digest(path), content))
    names = [one.name for one in drives]
    of_one_drive = [("drive0_bag.bag", "drive0_mcap"), ("drive1_bag.bag", "drive1_mcap")]
    for seed in range(200):
        found = dict(zip(names, place_recordings(drives, THIRDS, seed), strict=True))
        for one, other in [*of_one_drive, ("cut_a", "cut_b.bag")]:
            assert _split(found[one]) == _split(found[other])
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


def _split(placement: SplitPlacement | str) -> str:
    assert isinstance(placement, SplitPlacement)
    return placement.split
