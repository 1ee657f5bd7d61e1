from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from graspe_data.errors import ShardError, ZooError
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index, write_index
from model_zoo import metrics
from model_zoo.checkpoints import TemperatureScaling, load_checkpoint
from model_zoo.checkpoints.lineage import Lineage
from model_zoo.evaluation import evaluate, read_evaluation
from model_zoo.evaluation.evaluate import with_training
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.judged_split import open_judged_split
from tests.model_zoo.checkpoints.tiny_model import COLUMNS, TinyModel, write_tiny_dataset

Write = Callable[..., Path]
GROUPS = ("hill", "hill", "hill", "lake", "lake", "lake", "", "")


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    return write_tiny_dataset(tmp_path / "data", GROUPS)


def evaluated(folder: Path, dataset: Path, **changed: object) -> Evaluation:
    arguments = {"conditions": ("clean",), "resamples": 50, "batch_size": 7} | changed
    return evaluate(load_checkpoint(folder), dataset, **arguments)  # type: ignore[arg-type]


def test_scores_are_those_of_the_predictions_scenario_by_scenario(
    write_tiny: Write, dataset: Path
) -> None:
    folder = write_tiny()
    found = evaluated(folder, dataset)
    rows = Dataset(dataset, "test").batch(range(96))
    observation = {name: torch.from_numpy(rows[name]) for name in TinyModel.columns}
    z = load_checkpoint(folder).log_odds(observation).numpy()
    assert found.scenarios == ("hill", "lake", "ungrouped")
    for scenario, chosen in (("all", slice(96)), ("hill", slice(36)), ("lake", slice(36, 72))):
        cell = found.cell(scenario)
        assert cell is not None
        judged = rows["success_mask"] & (rows["state"] != 0)[:, None]
        labelled = (z[chosen], rows["success"][chosen], judged[chosen])
        assert cell.scores["au_roc"].value == pytest.approx(metrics.au_roc(*labelled))
        assert cell.scores["brier"].value == pytest.approx(metrics.brier(*labelled))
        assert cell.judged == labelled[2].sum()
        low, high = cell.scores["au_roc"].low, cell.scores["au_roc"].high
        assert low is not None
        assert high is not None
        assert low < high
        assert len(cell.parts["not_failing"].resamples) == 50


def test_a_temperature_that_saturates_float32_changes_no_rank(
    write_tiny: Write, dataset: Path
) -> None:
    weights = TinyModel()
    with torch.no_grad():
        weights.linear.weight.mul_(5)
    cells = []
    for temperature in (1.0, 0.05):
        calibration = TemperatureScaling(
            temperature=temperature, judged=9, loss_before=0.9, loss_after=0.8
        )
        name = f"at_{temperature}"
        folder = write_tiny(name, model=weights, calibration=calibration)
        cell = evaluated(folder, dataset).cell()
        assert cell is not None
        cells.append(cell)
    plain, cold = cells
    for name in ("au_roc", "minimum_au_roc", "average_precision", "failure_average_precision"):
        assert cold.scores[name] == plain.scores[name]
    assert cold.roc == plain.roc
    assert cold.scores["brier"].value > plain.scores["brier"].value  # type: ignore[operator]


def test_a_lost_sector_asks_for_what_r_point_follows_from(
    write_tiny: Write, dataset: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    checkpoint = load_checkpoint(write_tiny())
    monkeypatch.setattr(TinyModel, "columns", ("velocity_history", "r_point"))
    with pytest.raises(ZooError, match=r"no column smoothness.*leave lidar_sector_lost out"):
        evaluate(checkpoint, dataset, conditions=("clean", "lidar_sector_lost"))


@pytest.mark.parametrize("every", [2, 5, 10**30])
def test_every_so_many_rows_of_each_recording_from_its_first(
    write_tiny: Write, tmp_path: Path, every: int
) -> None:
    dataset = write_tiny_dataset(tmp_path / "data", GROUPS, judged=1.0)
    split = open_judged_split(load_checkpoint(write_tiny()), dataset, "test", ("clean",), every)
    ages = [11 - row % 12 for row in split.rows]  # stamps fall from row to row, 12 a recording
    assert ages == [age for _ in GROUPS for age in range(11, -1, -1) if age % every == 0]
    assert evaluated(write_tiny("other"), dataset, every=every).every == every


def test_every_must_be_positive(write_tiny: Write, dataset: Path) -> None:
    with pytest.raises(ZooError, match="every: found 0; give 1"):
        evaluated(write_tiny(), dataset, every=0)


def test_two_recordings_give_no_interval(write_tiny: Write, dataset: Path) -> None:
    cell = evaluated(write_tiny(), dataset).cell("ungrouped")
    assert cell is not None
    assert cell.recordings == 2
    assert cell.scores["au_roc"].value is not None
    assert cell.scores["au_roc"].low is None
    assert cell.parts["not_failing"].resamples == ()


def test_an_evaluation_names_what_it_is_of_and_is_read_back(
    write_tiny: Write, dataset: Path, tmp_path: Path
) -> None:
    checkpoint = load_checkpoint(write_tiny(seed=4))
    found = evaluate(checkpoint, dataset, conditions=("clean",), resamples=10)
    assert (found.model, found.preset, found.seed, found.parameters) == ("tiny", "small", 4, 30)
    assert (found.checkpoint, found.temperature) == (checkpoint.digest, 2.0)
    assert found.recipe is not None
    assert found.recipe.values["epochs"] == 2
    assert "seed" not in found.recipe.values
    assert found.dataset == Dataset(dataset, "test").digest
    assert found.latency.median_ms <= found.latency.p90_ms
    assert found.latency.weight_bytes == 30 * 4 + 8
    found.write(tmp_path / "evaluation.json")
    assert read_evaluation(tmp_path / "evaluation.json") == found


def test_an_evaluation_that_does_not_tell_the_recipe_is_read(
    write_tiny: Write, dataset: Path, tmp_path: Path
) -> None:
    found = evaluated(write_tiny(), dataset)
    older = json.loads(found.model_dump_json(exclude={"recipe", "steps", "settings"}))
    (tmp_path / "older.json").write_text(json.dumps(older))
    again = read_evaluation(tmp_path / "older.json")
    assert again == found.model_copy(update={"recipe": None, "steps": None, "settings": None})
    assert with_training(again, load_checkpoint(write_tiny())) == found


def test_batches_change_nothing(write_tiny: Write, dataset: Path) -> None:
    cells = [evaluated(write_tiny(), dataset, batch_size=size).cells for size in (1, 7, 100)]
    for other in cells[1:]:
        for one, same in zip(cells[0], other, strict=True):
            assert one.scores["brier"].value == pytest.approx(same.scores["brier"].value)


class Heard:
    def __init__(self) -> None:
        self.said: list[object] = []

    def start(self, what: str, total: int) -> None:
        self.said.append((what, total))

    def advance(self, message: str) -> None:
        self.said.append(message)


def test_progress_is_told(write_tiny: Write, dataset: Path) -> None:
    heard = Heard()
    evaluated(write_tiny(), dataset, batch_size=60, progress=heard)
    assert heard.said == [("batches", 2), "tiny: 60 of 96 rows", "tiny: 96 of 96 rows"]


def test_conditions_change_what_is_seen(write_tiny: Write, dataset: Path) -> None:
    found = evaluated(write_tiny(), dataset, conditions=("clean", "dark"))
    assert found.conditions == ("clean", "dark")
    clean, dark = found.cell("all", "clean"), found.cell("all", "dark")
    assert clean is not None
    assert dark is not None
    assert clean.scores["au_roc"].value != dark.scores["au_roc"].value
    assert clean.judged == dark.judged


def test_one_class_is_no_fault_of_a_test_split(write_tiny: Write, tmp_path: Path) -> None:
    folder = write_tiny_dataset(tmp_path / "good", ("hill", "hill"), success=True)
    cell = evaluated(write_tiny(), folder).cell()
    assert cell is not None
    assert cell.success_share == 1
    assert cell.scores["au_roc"].value is None
    assert cell.scores["brier"].value is not None
    assert cell.roc is None


def test_data_that_does_not_fit_is_refused(
    write_tiny: Write, dataset: Path, tmp_path: Path
) -> None:
    folder = write_tiny()
    for conditions in ((), ("clean", "foggy"), ("clean", "clean")):
        with pytest.raises(ZooError, match="give one or more, once each, of clean, dark"):
            evaluated(folder, dataset, conditions=conditions)
    with pytest.raises(ShardError, match="no split 'exam'"):
        evaluated(folder, dataset, split="exam")
    blind = tuple(column for column in COLUMNS if column.name != "r_img")
    lacking = write_tiny_dataset(tmp_path / "blind", ("hill",), columns=blind)
    with pytest.raises(ZooError, match="no column 'r_img', which tiny reads"):
        evaluated(folder, lacking)
    nameless = tuple(column for column in COLUMNS if column.name != "recording")
    lacking = write_tiny_dataset(tmp_path / "nameless", ("hill",), columns=nameless)
    with pytest.raises(ZooError, match=r"column recording: .*found no such column"):
        evaluated(folder, lacking)
    with pytest.raises(ZooError, match="a group is named 'all'"):
        evaluated(folder, write_tiny_dataset(tmp_path / "all", ("all",)))
    unjudged = write_tiny_dataset(tmp_path / "unjudged", ("hill",), judged=0.0)
    with pytest.raises(ZooError, match=r"none of its 12 rows has a judged step.*nobody reviewed"):
        evaluated(folder, unjudged)
    write_index(
        unjudged, read_index(unjudged).model_copy(update={"splits": {"test": []}, "recordings": []})
    )
    with pytest.raises(ZooError, match=r"'test' has no rows.*found: test 0.*split\.groups") as none:
        evaluated(folder, unjudged)
    assert "Label" not in str(none.value)
    further = TinyModel(4)
    other = write_tiny("further", model=further, numbers={"horizon": 4})
    with pytest.raises(ZooError, match=r"column success: expected rows of shape \(4,\)"):
        evaluated(other, dataset)


def test_nan_in_a_column_is_named_as_a_cause(write_tiny: Write, tmp_path: Path) -> None:
    folder = write_tiny_dataset(tmp_path / "nan", ("hill",), r_img=np.float32(np.nan))
    with pytest.raises(ZooError, match=r"column r_img holds a number that is not finite"):
        evaluated(write_tiny(), folder)


@pytest.mark.parametrize("share", [-0.1, 1.5])
def test_a_reliability_beyond_0_to_1_is_refused(
    write_tiny: Write, tmp_path: Path, share: float
) -> None:
    folder = write_tiny_dataset(tmp_path / "beyond", ("hill",), r_img=np.float32(share))
    with pytest.raises(ZooError, match=r"column r_img holds .* outside of 0\.\.1"):
        evaluated(write_tiny(), folder)


def test_recordings_that_taught_a_checkpoint_do_not_examine_it(
    write_tiny: Write, dataset: Path
) -> None:
    taught = write_tiny("taught", lineage=Lineage(taught=(f"{3:064x}",)))
    with pytest.raises(ZooError, match=r"1 of the 8 recordings .*'test' .*first 3\.bag"):
        evaluated(taught, dataset)


def test_an_au_roc_that_is_not_that_of_its_curve_is_refused(
    write_tiny: Write, dataset: Path, tmp_path: Path
) -> None:
    found, file = evaluated(write_tiny(), dataset), tmp_path / "evaluation.json"
    found.write(file)
    assert read_evaluation(file) == found
    content = json.loads(file.read_text())
    cell = content["cells"][0]
    for score in (cell["scores"]["au_roc"], cell["parts"]["not_failing"]["au_roc"]):
        score["value"] = 0.999
    file.write_text(json.dumps(content))
    with pytest.raises(ZooError, match=r"au_roc is 0\.999, the area under its curve is 0\."):
        read_evaluation(file)


def test_a_row_of_no_recording_is_refused(write_tiny: Write, tmp_path: Path) -> None:
    folder = write_tiny_dataset(tmp_path / "lost", ("hill", "lake"), recording=9)
    with pytest.raises(ZooError, match="column recording: found 9, expected 0 to 6"):
        evaluated(write_tiny(), folder)


@pytest.mark.parametrize("column", ["success", "velocity_history"])
def test_a_flipped_bit_is_found(write_tiny: Write, dataset: Path, column: str) -> None:
    stored = Dataset(dataset, "test", (column,)).batch(range(96))[column].tobytes()
    shard = dataset / "test" / "0.npz"
    content = bytearray(shard.read_bytes())
    content[content.index(stored)] ^= 1
    shard.write_bytes(content)
    with pytest.raises(ShardError, match=f"{column}: its sha256 does not match"):
        evaluated(write_tiny(), dataset)


def test_a_device_that_is_not_there_is_refused(
    write_tiny: Write, dataset: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(ZooError, match="cuda was asked for and torch finds none"):
        evaluated(write_tiny(), dataset, device="cuda")
    assert evaluated(write_tiny(), dataset, device="auto").latency.device == "cpu"


def test_files_that_are_no_evaluation_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "evaluation.json"
    with pytest.raises(ZooError, match="cannot be read"):
        read_evaluation(path)
    with pytest.raises(ZooError, match="no regular file"):
        read_evaluation(tmp_path)
    for text, said in (
        ("[]", "expected a mapping"),
        ("{", "not valid JSON"),
        ("{}", "model: Field required"),
        ('{"format": "graspe-evaluation-7"}', "format"),
    ):
        path.write_text(text)
        with pytest.raises(ZooError, match=said):
            read_evaluation(path)
