"""From recordings to a dataset: the same bytes however it is done, and only what changed."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from graspe_data.errors import StageError
from graspe_data.observation.labels import Annotation, Interval, annotation_path, write_annotation
from graspe_data.progress import Silent
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index
from graspe_data.shards.verify import verify_dataset
from graspe_data.simulation.message_stream import START_NS
from graspe_data.simulation.motion.drivers import Leg
from pipelines.build import BuildResult, build_dataset
from pipelines.dataset_folder import only_builder
from pipelines.dataset_settings import DatasetRecipe, Group, SplitSettings, StorageSettings
from pipelines.executors import Workers
from pipelines.rederive import rederive_rows
from tests.pipelines.conftest import RecordingFactory
from tests.pipelines.file_digests import file_digests


def build(
    recipe: DatasetRecipe, recordings: list[Path], out: Path, workers: Workers | None = None
) -> BuildResult:
    return build_dataset(recipe, recordings, out, workers or Workers(), Silent())


def changed(recipe: DatasetRecipe, **values: object) -> DatasetRecipe:
    return recipe.model_copy(update={"dataset": recipe.dataset.model_copy(update=values)})


def test_all_containers_give_the_same_rows(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    rows = {}
    for container in ("bag", "db3", "mcap"):
        split = SplitSettings(train=1, validation=0, test=0)
        folder = tmp_path / container
        build(changed(recipe, split=split), [record(f"x_{container}", container)], folder)
        dataset = Dataset(folder, "train")
        batch = dataset.batch(np.arange(len(dataset)))
        order = np.argsort(batch["stamp_ns"])
        rows[container] = {name: values[order] for name, values in batch.items()}
    for container in ("db3", "mcap"):
        for name in ("image", "stamp_ns", "laser_scan", "velocity_history", "success", "r_img"):
            np.testing.assert_array_equal(rows[container][name], rows["bag"][name])


def test_the_bytes_do_not_depend_on_the_workers(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recordings = [record("a"), record("b", "bag", seed=1)]
    build(recipe, recordings, tmp_path / "one")
    build(recipe, recordings[::-1], tmp_path / "two", Workers(processes=2))
    assert file_digests(tmp_path / "one") == file_digests(tmp_path / "two")


def test_running_again_does_nothing_and_a_new_recording_is_the_only_one_processed(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    first, out = record("a"), tmp_path / "out"
    assert build(recipe, [first], out).worked_on == ("a",)
    before = file_digests(out)
    assert build(recipe, [first], out).worked_on == ()
    assert file_digests(out) == before
    second = record("b", seed=1)
    assert build(recipe, [first, second], out).worked_on == ("b",)
    build(recipe, [first, second], tmp_path / "fresh")
    assert file_digests(out) == file_digests(tmp_path / "fresh")


def test_a_label_by_a_person_runs_the_label_stage_alone(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording, out = record("a"), tmp_path / "out"
    build(recipe, [recording], out)
    stages = {path.name for path in (out / "episodes").glob("*/*")}
    annotation = Annotation(recording="a", time_zero_ns=0, reviewer="someone")
    write_annotation(annotation_path(recording), annotation)
    build(recipe, [recording], out)
    again = {path.name for path in (out / "episodes").glob("*/*")}
    assert {name.split("-")[0] for name in again - stages} == {"label"}


def test_the_digest_names_the_rows_and_not_their_layout(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording = record("a")
    small = build(recipe, [recording], tmp_path / "small").index
    storage = StorageSettings(rows_per_shard=100)
    large = build(changed(recipe, storage=storage), [recording], tmp_path / "large").index
    other = build(changed(recipe, seed=1), [recording], tmp_path / "other").index
    assert small.dataset_digest == large.dataset_digest != other.dataset_digest
    split = next(name for name in small.splits if small.rows(name))
    rows = [Dataset(tmp_path / name, split).batch(range(5)) for name in ("small", "large")]
    np.testing.assert_array_equal(rows[0]["image"], rows[1]["image"])


def test_groups_stay_together(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recordings = [record("day1_a"), record("day1_b", seed=1), record("day2", seed=2)]
    split = SplitSettings(
        groups=(
            Group(name="one", recordings=("day1_*",), split="train"),
            Group(name="two", recordings=("day2",), split="test"),
        )
    )
    index = build(changed(recipe, split=split), recordings, tmp_path / "out").index
    assert {entry.name: (entry.group, entry.split) for entry in index.recordings} == {
        "day1_a": ("one", "train"),
        "day1_b": ("one", "train"),
        "day2": ("two", "test"),
    }


def test_a_bad_recording_does_not_stop_the_others(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    bad = tmp_path / "recordings" / "bad.bag"
    good = record("good")
    bad.write_bytes(b"#ROSBAG V2.0\n" + b"\xff" * 200)
    result = build(recipe, [bad, good], tmp_path / "out")
    assert [refusal.path.name for refusal in result.refused] == ["bad.bag"]
    entry = next(e for e in result.index.recordings if e.name == "bad.bag")
    assert entry.rows == 0
    assert str(tmp_path) not in str(entry.details["refused"])


def test_the_same_recording_twice_counts_once(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    first = record("a", "bag")
    copy = first.with_name("copy.bag")
    copy.write_bytes(first.read_bytes())
    result = build(recipe, [first, copy], tmp_path / "out")
    assert [r.reason for r in result.refused] == [
        "copy.bag: the same recording as a.bag; it counts once."
    ]


def test_no_rows_at_all_is_an_error_with_the_reasons(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    short = record("short", legs=(Leg(0.5, 0.5, 0.0),))
    with pytest.raises(StageError, match=r"(?s)No recording makes a row.*history begins before"):
        build(recipe, [short], tmp_path / "out")


def test_two_builds_in_one_folder_are_refused(recipe: DatasetRecipe, tmp_path: Path) -> None:
    with (
        only_builder(tmp_path / "out"),
        pytest.raises(StageError, match=r"another process is building here"),
    ):
        build(recipe, [], tmp_path / "out")


def test_png_pictures_decode_to_the_raw_ones(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording = record("a")
    build(recipe, [recording], tmp_path / "raw")
    storage = StorageSettings(image_codec="png")
    index = build(changed(recipe, storage=storage), [recording], tmp_path / "png").index
    split = next(name for name in index.splits if index.rows(name))
    rows = [Dataset(tmp_path / name, split).batch(range(5))["image"] for name in ("raw", "png")]
    np.testing.assert_array_equal(rows[0], rows[1])


@pytest.mark.parametrize("codec", ["raw", "png"])
def test_rows_are_proved_against_the_recordings(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path, codec: Literal["raw", "png"]
) -> None:
    recording, out = record("a"), tmp_path / "out"
    storage = StorageSettings(image_codec=codec)
    build(changed(recipe, storage=storage), [recording], out)
    moved = recording.rename(recording.with_name("renamed"))
    result = rederive_rows(out, [moved], count=6, seed=3)
    assert (result.rows, result.faults) == (6, ())


def test_a_changed_row_is_named_by_the_proof(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording, out = record("a"), tmp_path / "out"
    index = build(recipe, [recording], out).index
    split = next(name for name in index.splits if index.rows(name))
    shard = out / index.splits[split][0].path
    content = bytearray(shard.read_bytes())
    picture = Dataset(out, split, columns=("image",)).row(3)["image"].tobytes()
    content[bytes(content).index(picture) + 10] ^= 1
    shard.write_bytes(content)
    faults = rederive_rows(out, [recording], count=1000, seed=0).faults
    assert len(faults) == 1
    assert f"{split} row 3" in faults[0]
    assert "column image" in faults[0]
    assert any("image" in str(fault) for fault in verify_dataset(out))


def test_the_configuration_is_saved_with_the_dataset(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    build(recipe, [record("a")], tmp_path / "out")
    configuration = read_index(tmp_path / "out").configuration
    assert configuration["robot"] == recipe.robot.model_dump(mode="json")


def test_a_damaged_episode_is_found_out_and_done_again(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording, out = record("a"), tmp_path / "out"
    build(recipe, [recording], out)
    before = file_digests(out)
    picture = next((out / "episodes").glob("*/extract-*/image.npy"))
    content = bytearray(picture.read_bytes())
    content[-1] ^= 1
    picture.write_bytes(content)
    assert build(recipe, [recording], out).worked_on == ("a",)
    assert file_digests(out) == before


def test_a_damaged_shard_is_found_out_and_made_again(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording, out = record("a"), tmp_path / "out"
    index = build(recipe, [recording], out).index
    before = file_digests(out)
    split = next(name for name in index.splits if index.rows(name))
    shard = out / index.splits[split][0].path
    content = bytearray(shard.read_bytes())
    content[len(content) // 2] ^= 1
    shard.write_bytes(content)
    build(recipe, [recording], out)
    assert file_digests(out) == before


def test_the_trajectory_is_in_the_pictures(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    index = build(recipe, [record("a")], tmp_path / "out").index
    split = next(name for name in index.splits if index.rows(name))
    dataset = Dataset(tmp_path / "out", split, columns=("trajectory_image",))
    drawn = dataset.batch(range(len(dataset)))["trajectory_image"].any(axis=(1, 2))
    assert drawn.mean() > 0.3


def test_a_linked_recording_keeps_its_name_its_labels_and_its_split(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    stored = record("0001", "bag")
    link = tmp_path / "forest_monday.bag"
    link.symlink_to(stored)
    annotation = Annotation(recording=link.name, time_zero_ns=0, reviewer="someone")
    write_annotation(link.with_name(f"{link.name}.labels.yaml"), annotation)
    split = SplitSettings(groups=(Group(name="forest", recordings=("forest_*",), split="test"),))
    entry = build(changed(recipe, split=split), [link], tmp_path / "out").index.recordings[0]
    assert (entry.name, entry.split, entry.details["annotated"]) == (link.name, "test", True)


def test_a_folder_with_other_files_is_no_place_for_a_dataset(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording = record("a")
    with pytest.raises(StageError, match=r"holds other files \(a\)"):
        build(recipe, [recording], recording.parent)


def test_an_interval_outside_the_recording_is_refused(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording = record("a")
    interval = Interval(start_s=40, stop_s=45, kind="stuck", verdict="added")
    annotation = Annotation(time_zero_ns=START_NS, reviewer="someone", intervals=(interval,))
    write_annotation(annotation_path(recording), annotation)
    with pytest.raises(StageError, match=r"interval 0, 40 to 45 s, lies outside.*0\.0 to 6\.5 s"):
        build(recipe, [recording], tmp_path / "out")
