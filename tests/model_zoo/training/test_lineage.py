"""A checkpoint knows the recordings, the ranks and the precision behind its figures."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import ZooError
from graspe_data.observation.settings import ObservationSettings
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, read_index
from model_zoo.checkpoints.lineage import Lineage, check_observed_alike
from model_zoo.checkpoints.load import read_description
from model_zoo.metrics import au_roc
from model_zoo.training.train import train
from tests.model_zoo.training.smallest import RECIPE, SMALLEST, write_rows
from tests.model_zoo.training.test_ranks import log_odds
from tests.model_zoo.training.test_train import changed
from tests.model_zoo.training.tiny import MACHINE, train_tiny


def index_of(*recordings: RecordingEntry) -> DatasetIndex:
    return DatasetIndex(
        name="made", columns=(), group_key="day", splits={}, recordings=list(recordings)
    )


def recording(number: int, split: str, content: int | None = None) -> RecordingEntry:
    details = {} if content is None else {"content": f"{content:064x}"}
    name, digest = f"{number}.bag", f"{number:064x}"
    return RecordingEntry(name=name, digest=digest, group=split, split=split, details=details)


def test_it_is_written_with_the_checkpoint(dataset: Path, tmp_path: Path) -> None:
    train_tiny(dataset, tmp_path)
    config, _ = read_description(tmp_path / "checkpoint")
    assert config.lineage == Lineage.of(read_index(dataset), 1)
    assert config.lineage is not None
    assert config.lineage.taught == tuple(
        entry.digest for entry in read_index(dataset).recordings if entry.split == "train"
    )


@dataclass(frozen=True)
class Seen:
    """A recording of the examined split, and what the refusal says of it."""

    entry: RecordingEntry
    said: str


LINEAGE = Lineage.of(index_of(recording(1, "train", 11), recording(2, "validation", 12)), 1)


@pytest.mark.parametrize(
    "seen",
    [
        Seen(recording(1, "test"), "in the train split"),
        Seen(recording(9, "test", 11), "in the train split"),
        Seen(recording(2, "test"), "in the validation split"),
        Seen(recording(9, "test", 12), "in the validation split"),
    ],
)
def test_recordings_that_made_a_model_do_not_examine_it(seen: Seen) -> None:
    index = index_of(recording(3, "test"), seen.entry)
    with pytest.raises(ZooError, match=f"1 of the 2 recordings of the split 'test' .*{seen.said}"):
        LINEAGE.check_unseen(index, "test", "data")


def test_recordings_that_are_new_do() -> None:
    LINEAGE.check_unseen(index_of(recording(3, "test", 13), recording(1, "train")), "test", "data")
    LINEAGE.check_unseen(index_of(recording(1, "train")), "train", "data")


def observation(**changes: Any) -> dict[str, Any]:
    made = ObservationSettings.model_validate(
        {
            "picture_size": (240, 320),
            "points": {},
            "image_reliability": {},
            "point_reliability": {},
            "history_steps": 50,
            "history_step_s": 0.1,
            "odometry_gap_s": 0.5,
            "points_tolerance_s": 0.1,
            "horizon_steps": 10,
            "horizon_step_s": 0.2,
        }
    )
    return made.model_dump() | changes


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"horizon_step_s": 0.3}, r"made with horizon_step_s 0\.3, the checkpoint's with 0\.2"),
        ({"history_step_s": 0.05}, "history_step_s"),
        ({"drawn_from_behind": 1.0}, "drawn_from_behind"),
        ({"points": observation()["points"] | {"neighbours": 3}}, r"points\.neighbours 3"),
    ],
)
def test_rows_made_otherwise_are_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ZooError, match=said):
        check_observed_alike(observation(), observation(**changes), "data")


def test_another_robot_may_be_tried() -> None:
    lidar = observation()["points"] | {"rings": 32, "base_height": 0.7}
    check_observed_alike(observation(), observation(points=lidar), "data")


def test_without_a_state_the_checkpoint_of_two_ranks_is_anothers(
    dataset: Path, tmp_path: Path
) -> None:
    train_tiny(dataset, tmp_path)
    file = tmp_path / "checkpoint/config.json"
    content = json.loads(file.read_text())
    content["lineage"]["ranks"] = 2
    file.write_text(json.dumps(content))
    _seal_anew(tmp_path / "checkpoint")
    (tmp_path / "state.safetensors").unlink()
    with pytest.raises(ZooError, match="ranks was 2, is 1"):
        train_tiny(dataset, tmp_path)


def _seal_anew(folder: Path) -> None:
    seal = json.loads((folder / "manifest.json").read_text())
    for name in seal["files"]:
        data = (folder / name).read_bytes()
        seal["files"][name] = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    (folder / "manifest.json").write_text(json.dumps(seal))


def test_an_extension_refuses_a_state_that_is_not_the_checkpoint_s(
    dataset: Path, tmp_path: Path
) -> None:
    train_tiny(dataset, tmp_path / "long", changed(epochs=3))
    metrics = tmp_path / "long/checkpoint/metrics.json"
    content = json.loads(metrics.read_text())
    metrics.write_text(json.dumps(content | {"steps": 99}))
    _seal_anew(tmp_path / "long/checkpoint")
    with pytest.raises(ZooError, match=r"state is of step 18, the checkpoint .* of 99 steps"):
        train_tiny(dataset, tmp_path / "on", changed(epochs=5), begin=tmp_path / "long")


def test_an_epoch_that_was_cut_short_ends_where_it_would_have(
    dataset: Path, tmp_path: Path
) -> None:
    train_tiny(dataset, tmp_path / "cut", changed(epochs=9, most_steps=9))
    train_tiny(dataset, tmp_path / "on", changed(epochs=9, most_steps=24), begin=tmp_path / "cut")
    metrics = json.loads((tmp_path / "on/checkpoint/metrics.json").read_text())
    assert [epoch["step"] for epoch in metrics["history"]] == [6, 9, 12, 18, 24]


@pytest.mark.parametrize("name", ["graspe", "nmfnet"])
def test_in_bf16_the_published_score_is_that_of_the_published_weights(
    name: str, tmp_path: Path
) -> None:
    data, recipe = write_rows(tmp_path / "data"), RECIPE.model_copy(update={"precision": "bf16"})
    train(name, "small", data, recipe, tmp_path / "run", None, MACHINE, **SMALLEST[name])
    metrics = json.loads((tmp_path / "run/checkpoint/metrics.json").read_text())
    logits, success, mask = log_odds(tmp_path / "run", data)
    assert metrics["au_roc"] == pytest.approx(au_roc(logits, success, mask), abs=1e-9)
    assert metrics["loss"] == pytest.approx(
        float(np.mean(np.logaddexp(0, logits) - success * logits)), rel=1e-5
    )
