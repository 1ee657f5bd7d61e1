from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from torch import Tensor

from graspe_data.columns import Column
from graspe_data.errors import ShardError, ZooError
from graspe_data.sealed_folder import SEAL_FILE
from model_zoo.contract import Loss, Observation
from model_zoo.training.machine import Machine
from model_zoo.training.progress import SilentProgress, StepReport
from model_zoo.training.recipe import Recipe
from model_zoo.training.state import EpochRecord
from tests.model_zoo.training.tiny import (
    MACHINE,
    RECIPE,
    TinyModel,
    columns,
    make_model,
    make_rows,
    make_splits,
    train_tiny,
    write_dataset,
)


class Told(SilentProgress):
    def __init__(self) -> None:
        self.steps: list[StepReport] = []
        self.epochs: list[tuple[EpochRecord, bool]] = []
        self.began: tuple[int, int] | None = None

    def start(self, what: str, steps: int, done: int) -> None:
        assert what == "tiny small"
        self.began = (steps, done)

    def step(self, report: StepReport) -> None:
        self.steps.append(report)

    def epoch(self, record: EpochRecord, best: bool) -> None:
        self.epochs.append((record, best))


def changed(**fields: object) -> Recipe:
    return Recipe.model_validate({**RECIPE.model_dump(), **fields})


def test_it_learns_and_leaves_a_sealed_checkpoint_of_its_best_weights(
    dataset: Path, tmp_path: Path
) -> None:
    progress = Told()
    model = train_tiny(dataset, tmp_path, changed(epochs=20), progress=progress)
    assert progress.began == (120, 0)
    records = [record for record, _ in progress.epochs]
    assert records[-1].means["loss"] < 0.6 * records[0].means["loss"]
    metrics = json.loads((tmp_path / "checkpoint/metrics.json").read_text())
    best = max(record.au_roc for record in records)
    assert metrics["au_roc"] == best > 0.95
    assert metrics["best_epoch"] == [record.au_roc for record in records].index(best)
    stored = load_file(tmp_path / "checkpoint/model.safetensors")
    assert all(torch.equal(stored[name], value) for name, value in model.state_dict().items())
    calibration = json.loads((tmp_path / "checkpoint/calibration.json").read_text())
    assert calibration["method"] == "none"
    assert calibration["reason"].startswith("3 validation rows have a failing step and 9 ")


def test_with_enough_failing_rows_it_is_calibrated_and_scored_so(tmp_path: Path) -> None:
    splits = make_splits()
    splits["validation"] = make_rows(60, 1, 1)
    dataset = write_dataset(tmp_path / "data", splits)
    train_tiny(dataset, tmp_path, changed(epochs=10))
    calibration, metrics = (
        json.loads((tmp_path / "checkpoint" / name).read_text())
        for name in ("calibration.json", "metrics.json")
    )
    assert calibration["failing_rows"] == 20
    assert calibration["loss_after"] < calibration["loss_before"] == pytest.approx(metrics["loss"])
    card = (tmp_path / "checkpoint/card.md").read_text()
    assert f"temperature {calibration['temperature']:.3f}, fitted on 180" in card


def test_progress_has_rate_loss_time_left_and_the_share_of_waiting(
    dataset: Path, tmp_path: Path
) -> None:
    progress = Told()
    train_tiny(dataset, tmp_path, progress=progress)
    last = progress.steps[-1]
    assert (last.step, last.steps, last.seconds_left) == (18, 18, 0)
    assert last.samples_per_s > 0
    assert 0 < last.loss < 5
    assert 0 <= last.data_wait_share <= 1
    assert {"loss", "half", "gradient_length"} == progress.epochs[0][0].means.keys()


def test_each_row_is_taught_once_an_epoch_in_another_order(dataset: Path, tmp_path: Path) -> None:
    model = make_model()
    train_tiny(dataset, tmp_path, model=model)
    assert model.batches == 6
    epochs = [list(chain.from_iterable(model.taught[begin : begin + 6])) for begin in (0, 6, 12)]
    assert [sorted(epoch) for epoch in epochs] == [sorted(epochs[0])] * 3
    assert len(set(epochs[0])) == 24
    assert epochs[0] != epochs[1] != epochs[2]


def test_a_budget_of_steps_ends_within_an_epoch(dataset: Path, tmp_path: Path) -> None:
    progress = Told()
    train_tiny(dataset, tmp_path, changed(most_steps=8), progress=progress)
    assert [record.step for record, _ in progress.epochs] == [6, 8]


def test_patience_stops_and_the_best_epoch_is_kept(dataset: Path, tmp_path: Path) -> None:
    progress = Told()
    recipe = changed(epochs=30, patience=2, learning_rate=1e-9)
    train_tiny(
        dataset, tmp_path, recipe, model=make_model(dropout=0.0, norm=False), progress=progress
    )
    assert [best for _, best in progress.epochs] == [True, False, False]


def test_bf16_cosine_clipping_and_augmentation(dataset: Path, tmp_path: Path) -> None:
    recipe = changed(precision="bf16", schedule="cosine", warm_up_steps=3, augmentation={})
    model = train_tiny(dataset, tmp_path, recipe)
    assert all(value.isfinite().all() for value in model.state_dict().values())
    assert {value.dtype for value in model.parameters()} == {torch.float32}


def test_readers_change_nothing(dataset: Path, tmp_path: Path) -> None:
    alone = train_tiny(dataset, tmp_path / "a", changed(augmentation={}))
    helped = MACHINE.model_copy(update={"workers": 1})
    other = train_tiny(dataset, tmp_path / "b", changed(augmentation={}), machine=helped)
    pairs = zip(alone.state_dict().values(), other.state_dict().values(), strict=True)
    assert all(torch.equal(*pair) for pair in pairs)


def test_resampling_teaches_each_failure_twice_once_mirrored(dataset: Path, tmp_path: Path) -> None:
    seen: list[tuple[float, float]] = []

    class Watching(TinyModel):
        def logits(self, observation: Observation) -> Tensor:
            if self.training:
                turning = observation["velocity_history"][:, 0, 1].tolist()
                seen.extend(zip(observation["r_img"].tolist(), turning, strict=True))
            return super().logits(observation)

    train_tiny(dataset, tmp_path, changed(balance="resample", epochs=1), model=Watching())
    failing = make_splits()["train"]["r_img"][::3].tolist()
    for row in failing:
        turns = [turn for name, turn in seen if name == row]
        assert len(turns) == 2
        assert turns[0] == -turns[1]
    assert len(seen) == 32


def test_it_is_logged_for_tensorboard(dataset: Path, tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import (  # noqa: PLC0415
        EventAccumulator,
    )

    machine = MACHINE.model_copy(update={"tensorboard": True})
    train_tiny(dataset, tmp_path, machine=machine)
    events = EventAccumulator(str(tmp_path / "log")).Reload()
    assert {"epoch/au_roc", "epoch/data_wait_share", "step/loss", "step/half"} <= set(
        events.Tags()["scalars"]
    )
    assert [event.step for event in events.Scalars("epoch/au_roc")] == [6, 12, 18]


def test_a_finished_training_is_not_done_again(dataset: Path, tmp_path: Path) -> None:
    train_tiny(dataset, tmp_path)
    sealed = (tmp_path / "checkpoint" / SEAL_FILE).stat().st_mtime_ns
    model = make_model()
    train_tiny(dataset, tmp_path, model=model)
    assert model.taught == []
    assert (tmp_path / "checkpoint" / SEAL_FILE).stat().st_mtime_ns == sealed


def test_a_checkpoint_that_was_lost_is_written_again(dataset: Path, tmp_path: Path) -> None:
    train_tiny(dataset, tmp_path)
    files = {path.name: path.read_bytes() for path in (tmp_path / "checkpoint").iterdir()}
    (tmp_path / "checkpoint" / SEAL_FILE).unlink()
    train_tiny(dataset, tmp_path)
    assert {p.name: p.read_bytes() for p in (tmp_path / "checkpoint").iterdir()} == files


def test_a_training_that_diverges_says_so(dataset: Path, tmp_path: Path) -> None:
    model = make_model(norm=False)
    torch.nn.init.constant_(model.net[0].weight, float("inf"))  # type: ignore[arg-type]
    with pytest.raises(ZooError, match="expected finite numbers"):
        train_tiny(dataset, tmp_path / "a", model=model)

    class Exploding(TinyModel):
        def loss(
            self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor
        ) -> Loss:
            loss = super().loss(observation, success, mask, weight)
            return replace(loss, total=loss.total * float("nan"), parts={})

    with pytest.raises(ZooError, match=r"loss became nan .* Lower the recipe's learning_rate"):
        train_tiny(dataset, tmp_path / "b", model=Exploding())
    assert not (tmp_path / "b/checkpoint").exists()


Change = Callable[[dict[str, dict[str, object]]], None]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda s: s.pop("validation"), "no rows in the split 'validation', .* train 24"),
        (lambda s: s["train"]["success"].fill(1), "split 'train': .* are all successes"),
        (lambda s: s["validation"]["success"].fill(0), "split 'validation': .* are all failures"),
        (lambda s: s["train"]["success_mask"].fill(0), "none of 24 rows has a judged step"),
        (
            lambda s: s["train"]["success"].__imul__(255),
            "split 'train': success: row 0 holds 255, expected 0 for failure or 1",
        ),
        (
            lambda s: s["train"]["r_img"].__setitem__(5, float("nan")),
            r"split 'train', row 5 \(recording train.bag\): column r_img",
        ),
        (
            lambda s: s["validation"]["velocity_history"].__setitem__((2, 1, 0), float("inf")),
            r"split 'validation', row 2 \(recording validation.bag\): column velocity_history",
        ),
    ],
)
def test_bad_data_is_refused_before_training(tmp_path: Path, change: Change, text: str) -> None:
    splits = make_splits()
    change(splits)  # type: ignore[arg-type]
    model = make_model()
    with pytest.raises(ZooError, match=text):
        train_tiny(write_dataset(tmp_path / "bad", splits), tmp_path / "out", model=model)
    assert model.taught == []


@pytest.mark.parametrize("name", ["success", "velocity_history"])
def test_a_damaged_column_is_found_before_training(tmp_path: Path, name: str) -> None:
    splits = make_splits()
    folder = write_dataset(tmp_path / "damaged", splits)
    shard = folder / "train/0.npz"
    sound = splits["train"][name].tobytes()
    flipped = bytes([sound[0] ^ 1]) + sound[1:]
    assert shard.read_bytes().count(sound) == 1
    shard.write_bytes(shard.read_bytes().replace(sound, flipped))
    with pytest.raises(ShardError, match=f"{name}: its sha256 does not match"):
        train_tiny(folder, tmp_path / "out")


def test_a_missing_column_wrong_sizes_and_another_horizon_are_refused(
    dataset: Path, tmp_path: Path
) -> None:
    class Seeing(TinyModel):
        columns = ("image", "r_img")

    class Narrow(TinyModel):
        columns = ("velocity_history", "r_img", "laser_scan")

        def logits(self, observation: Observation) -> Tensor:
            return observation["laser_scan"] @ torch.zeros(7, 3)

    for model, text in (
        (Seeing(), "tiny needs the column image, which the dataset lacks; it has velocity_history"),
        (Narrow(), r"velocity_history float32 \(4, 2\), .* and refused them: mat1 and mat2"),
        (make_model(horizon=5), r"column success has rows of \(3,\), tiny predicts \(5,\)"),
    ):
        with pytest.raises(ZooError, match=text):
            train_tiny(dataset, tmp_path, model=model)


def test_a_dataset_smaller_than_a_step_is_refused(dataset: Path, tmp_path: Path) -> None:
    with pytest.raises(ZooError, match=r"24 training rows .* do not fill one step of 25"):
        train_tiny(dataset, tmp_path, changed(batch_size=25))


def test_batches_of_one_row_are_refused_where_they_are_normalised(
    dataset: Path, tmp_path: Path
) -> None:
    with pytest.raises(ZooError, match="batch_size is 1, expected 2 or more"):
        train_tiny(dataset, tmp_path / "a", changed(batch_size=1))
    plain = TinyModel(norm=False)
    train_tiny(dataset, tmp_path / "b", changed(batch_size=1, epochs=1), plain)


def test_pictures_of_another_dtype_are_refused(tmp_path: Path) -> None:
    class Drawn(TinyModel):
        columns = ("velocity_history", "r_img", "trajectory_image")

    drawn = Column(
        name="trajectory_image",
        dtype="float32",
        shape=(4, 6),
        unit="",
        frame="",
        meaning="",
        stage="test",
    )
    splits = {
        split: arrays | {"trajectory_image": np.zeros((len(arrays["success"]), 4, 6), np.float32)}
        for split, arrays in make_splits().items()
    }
    data = write_dataset(tmp_path / "dataset", splits, (*columns(), drawn))
    with pytest.raises(ZooError, match="trajectory_image is float32, expected uint8 or bool"):
        train_tiny(data, tmp_path / "run", model=Drawn())


def test_a_gpu_that_is_not_there_is_refused(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ZooError, match="cuda was asked for"):
        train_tiny(dataset, tmp_path, machine=Machine(device="cuda"))
