"""Damage to manifests, labels, stages and shards: found, or harmless, or one clear error."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from graspe_data.errors import GraspeError
from graspe_data.manifest import shipped_manifests
from graspe_data.observation.labels import (
    Annotation,
    annotation_path,
    read_annotation,
    write_annotation,
)
from graspe_data.observation.labels.verdicts import Interval
from graspe_data.progress import Silent
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index
from graspe_data.shards.verify import verify_dataset
from graspe_data.simulation.motion.drivers import Leg
from pipelines.build import build_dataset
from pipelines.dataset_settings import DatasetRecipe, load_recipe
from pipelines.executors import Workers
from pipelines.process_recording import RecordingTask, Refusal, process_recording
from pipelines.rederive import rederive_rows
from tests.pipelines.conftest import RecordingFactory
from tests.pipelines.file_digests import file_digests
from tests.pipelines.mutations import damage_file

MUTATIONS = 40


class Built:
    """A recording with labels and its dataset, of which damaged copies are made."""

    def __init__(self, recording: Path, recipe: DatasetRecipe, folder: Path) -> None:
        self.recording, self.recipe, self.folder = recording, recipe, folder
        self.sound = folder / "sound"
        self.build(self.sound)

    def build(self, out: Path) -> None:
        build_dataset(self.recipe, [self.recording], out, Workers(), Silent())

    def damaged(self, pattern: str, number: int) -> Path:
        """A copy of the dataset in which one file of a pattern is damaged."""
        out, generator = self.folder / f"damaged{number}", np.random.default_rng(number)
        shutil.copytree(self.sound, out)
        files = sorted(path for path in out.glob(pattern) if path.is_file())
        damage_file(files[int(generator.integers(len(files)))], generator)
        return out


@pytest.fixture
def built(record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path) -> Built:
    return Built(record(legs=(Leg(3.5, 0.6, 0.1),)), recipe, tmp_path)


def clear(action: Callable[[], object]) -> str:
    """Whether an action was done or refused; anything but a clear error goes on upwards."""
    try:
        action()
    except GraspeError:
        return "refused"
    return "done"


def test_damaged_manifests(tmp_path: Path) -> None:
    found: Counter[str] = Counter()
    manifests = tmp_path / "manifests"
    for number in range(MUTATIONS):
        shutil.copytree(shipped_manifests(), manifests)
        generator = np.random.default_rng(number)
        name = ("datasets/field.yaml", "robots/spot.yaml")[number % 2]
        damage_file(manifests / name, generator)
        text = (manifests / "datasets/field.yaml").read_bytes()
        (manifests / "datasets/field.yaml").write_bytes(
            text.replace(b": spot", b": ../robots/spot.yaml")
        )
        found[clear(lambda: load_recipe(manifests / "datasets/field.yaml"))] += 1
        shutil.rmtree(manifests)
    assert found["refused"] > MUTATIONS / 4


def test_damaged_labels(built: Built) -> None:
    interval = Interval(start_s=0.5, stop_s=1.0, kind="stuck", verdict="added", note="x")
    path = annotation_path(built.recording)
    found: Counter[str] = Counter()
    for number in range(MUTATIONS):
        write_annotation(
            path, Annotation(recording="drive", time_zero_ns=0, reviewer="a", intervals=(interval,))
        )
        damage_file(path, np.random.default_rng(number))
        state = clear(lambda: read_annotation(path))
        task = RecordingTask(built.recording, built.recipe, built.sound / "episodes")
        result = process_recording(task)
        assert (state == "refused") <= isinstance(result, Refusal)
        found[state] += 1
    assert found["refused"] > MUTATIONS / 4


@pytest.mark.parametrize("pattern", ["episodes/*/*/stage.json", "episodes/*/*/*.np[yz]"])
def test_damaged_stages_are_done_again(built: Built, pattern: str) -> None:
    sound = file_digests(built.sound)
    for number in range(MUTATIONS):
        out = built.damaged(pattern, number)
        if number % 2:
            _forget_shards(out)
        built.build(out)
        assert verify_dataset(out) == []
        assert file_digests(out) == sound
        shutil.rmtree(out)


def test_one_bit_of_a_record_is_enough_to_do_its_stage_again(built: Built) -> None:
    sound = file_digests(built.sound)
    for record in sorted(built.sound.glob("episodes/*/*/stage.json")):
        content = record.read_bytes()
        for place in range(0, len(content), max(1, len(content) // 10)):
            out = built.folder / "flipped"
            shutil.copytree(built.sound, out)
            flipped = bytearray(content)
            flipped[place] ^= 1
            (out / record.relative_to(built.sound)).write_bytes(flipped)
            built.build(out)
            assert file_digests(out) == sound
            shutil.rmtree(out)


def test_a_damaged_index_is_refused_or_says_the_same(built: Built) -> None:
    digest = read_index(built.sound).dataset_digest
    for number in range(MUTATIONS):
        out = built.damaged("dataset.json", number)
        clear(lambda out=out: _use(out, built.recording))  # type: ignore[misc]
        if clear(lambda out=out: verify_dataset(out)) == "done":  # type: ignore[misc]
            assert read_index(out).dataset_digest == digest
        clear(lambda out=out: built.build(out))  # type: ignore[misc]
        shutil.rmtree(out)


def test_every_damage_to_a_shard_is_found(built: Built) -> None:
    for number in range(MUTATIONS):
        out = built.damaged("shards/*.npz", number)
        clear(lambda out=out: _use(out, built.recording))  # type: ignore[misc]
        if any(
            path.read_bytes() != (out / path.relative_to(built.sound)).read_bytes()
            for path in built.sound.glob("shards/*.npz")
        ):
            assert verify_dataset(out)
        shutil.rmtree(out)


def _forget_shards(out: Path) -> None:
    """Back to before the shards and the labels were committed."""
    shutil.rmtree(out / "shards")
    (out / "dataset.json").unlink()
    shutil.rmtree(next(out.glob("episodes/*/label-*")), ignore_errors=True)


def _use(out: Path, recording: Path) -> None:
    for split in read_index(out).splits:
        dataset = Dataset(out, split)
        dataset.batch(range(len(dataset)))
    rederive_rows(out, [recording], count=2, seed=0)
