"""No score stands without the blind references."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.columns import Column
from graspe_data.errors import ZooError
from graspe_data.shards.dataset_index import read_index, write_index
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation import compare, evaluate, read_evaluation
from model_zoo.evaluation.blind_features import ALWAYS, REFERENCES, SCAN, blind_features
from model_zoo.evaluation.blind_references import as_array
from model_zoo.evaluation.blind_teaching import LabelledRows, teach_reference
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.scenes import scene_areas
from model_zoo.evaluation.summary import render_summary
from model_zoo.metrics import au_roc
from tests.model_zoo.checkpoints.tiny_model import COLUMNS, write_tiny_dataset

Write = Callable[..., Path]
GROUPS = ("hill", "hill", "hill", "lake")
WITH_SCAN = (
    *COLUMNS,
    Column(
        name="laser_scan", dtype="float32", shape=(40,), unit="", frame="", meaning="", stage="test"
    ),
)


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    return write_tiny_dataset(tmp_path / "data", GROUPS)


def evaluated(folder: Path, dataset: Path, **changed: Any) -> Evaluation:
    arguments: dict[str, Any] = {"conditions": ("clean",), "resamples": 30} | changed
    return evaluate(load_checkpoint(folder), dataset, **arguments)


def test_every_evaluation_has_all_references_and_leads(write_tiny: Write, dataset: Path) -> None:
    found = evaluated(write_tiny(), dataset)
    assert [reference.name for reference in found.references.scores] == list(ALWAYS)
    assert found.references.taught_on == read_index(dataset).dataset_digest
    whole = found.cell()
    assert whole is not None
    for part, lead in ((name, part.lead) for name, part in whole.parts.items()):
        if whole.parts[part].au_roc.value is None:
            assert lead is None
            continue
        areas = {r.name: r.cell().parts[part] for r in found.references.scores}  # type: ignore[union-attr]
        best = max(areas, key=lambda name: areas[name].au_roc.value or 0.0)
        assert lead is not None
        assert lead.reference == best
        drawn = as_array(whole.parts[part].resamples) - as_array(areas[best].resamples)
        assert lead.value == pytest.approx(
            whole.parts[part].au_roc.value - areas[best].au_roc.value  # type: ignore[operator]
        )
        assert (lead.low, lead.high) == pytest.approx(np.quantile(drawn, [0.025, 0.975]))


@pytest.mark.parametrize("name", ALWAYS)
def test_a_file_without_one_is_refused(
    write_tiny: Write, dataset: Path, tmp_path: Path, name: str
) -> None:
    content = json.loads(evaluated(write_tiny(), dataset).model_dump_json())
    scores = content["references"]["scores"]
    content["references"]["scores"] = [score for score in scores if score["name"] != name]
    path = tmp_path / "evaluation.json"
    path.write_text(json.dumps(content))
    with pytest.raises(ZooError, match=r"no score is shown without them.*\nEvaluate again"):
        read_evaluation(path)
    del content["references"]
    path.write_text(json.dumps(content))
    with pytest.raises(ZooError, match=r"references: Field required"):
        read_evaluation(path)


def test_tables_and_the_terminal_begin_with_them(
    write_tiny: Write, dataset: Path, tmp_path: Path
) -> None:
    found = evaluated(write_tiny(), dataset)
    shown = render_summary(found).splitlines()
    assert [line.startswith("blind: ") for line in shown[1:6]] == [True] * 4 + [False]
    assert shown[5].startswith("tiny ")
    assert "; lead over " in shown[7]
    text = compare([found], tmp_path / "out").read_text()
    table = text.split("## AU-ROC by scenario")[1].split("\n\n")[1].splitlines()[2:]
    assert [line.startswith("| blind: ") for line in table] == [True] * 4 + [False]
    assert "## Lead over the best blind reference" in text


def test_without_training_rows_nothing_is_scored(
    write_tiny: Write, dataset: Path, tmp_path: Path
) -> None:
    whole = read_index(dataset)
    bare = write_tiny_dataset(tmp_path / "bare", GROUPS)
    kept = [entry for entry in whole.recordings if entry.split == "test"]
    tested = {"splits": {"test": whole.splits["test"]}, "recordings": kept}
    write_index(bare, whole.model_copy(update=tested))
    folder = write_tiny()
    with pytest.raises(ZooError, match=r"no rows in the split 'train' to teach .*--references"):
        evaluated(folder, bare)
    same = write_tiny_dataset(tmp_path / "same", GROUPS)
    taught = [entry.model_copy(update={"split": "train"}) for entry in kept]
    moved = {"splits": {"train": read_index(same).splits["test"]}, "recordings": taught}
    write_index(same, whole.model_copy(update=moved))
    with pytest.raises(ZooError, match="have the same bytes"):
        evaluated(folder, bare, references=same)
    elsewhere = evaluated(folder, bare, references=dataset)
    assert elsewhere.references.taught_on == whole.dataset_digest


def test_evaluations_beside_other_references_are_not_compared(
    write_tiny: Write, dataset: Path, tmp_path: Path
) -> None:
    one, other = (evaluated(write_tiny(f"c{seed}", seed=seed), dataset) for seed in (0, 1))
    strange = other.references.model_copy(update={"taught_on": "0" * 64})
    other = other.model_copy(update={"model": "other", "references": strange})
    with pytest.raises(ZooError, match=r"differ in their blind references: taught on other data"):
        compare([one, other], tmp_path / "out")


def test_a_failing_scan_fails_for_the_reference_that_reads_it(
    write_tiny: Write, tmp_path: Path
) -> None:
    folder = write_tiny_dataset(tmp_path / "scan", GROUPS, columns=WITH_SCAN)
    found = evaluated(
        write_tiny(), folder, conditions=("clean", "dark", "lidar_sector_lost", "dust")
    )
    assert [reference.name for reference in found.references.scores] == list(REFERENCES)
    for reference in found.references.scores:
        felt = {"clean", "lidar_sector_lost", "dust"} if reference.name == SCAN else {"clean"}
        assert {cell.condition for cell in reference.cells} == felt
        assert reference.cell("all", "dark") == reference.cell("all", "clean")


def test_what_they_said_is_kept_and_a_damaged_file_is_made_again(
    write_tiny: Write, dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GRASPE_CACHE", str(tmp_path / "cache"))
    folder = write_tiny()
    first = evaluated(folder, dataset)
    (kept,) = (tmp_path / "cache").iterdir()
    content = kept.read_bytes()
    with monkeypatch.context() as untaught:
        untaught.setattr("model_zoo.evaluation.blind_predictions.teach_reference", None)
        assert evaluated(folder, dataset).references == first.references
    kept.write_bytes(content[: len(content) // 2])
    assert evaluated(folder, dataset).references == first.references
    assert kept.read_bytes() == content
    monkeypatch.setenv("GRASPE_CACHE", "")
    assert evaluated(folder, dataset).references == first.references


def test_each_reference_looks_at_its_own() -> None:
    draw = np.random.default_rng(0)
    velocity = draw.normal(size=(5, 2))
    scan = draw.uniform(1, 5, (5, 720))
    scan[:, :20] = np.inf
    columns = {"velocity_history": draw.normal(size=(5, 4, 2)), "laser_scan": scan}
    widths = [blind_features(name, velocity, columns).shape[1] for name in REFERENCES]
    assert widths == [0, 1, 4, 4 + 8, 4 + 8 + 36]
    assert (blind_features("speed", velocity, {})[:, 0] >= 0).all()
    sectors = blind_features(SCAN, velocity, columns)[:, 12:]
    assert sectors[:, 0].tolist() == [100.0] * 5
    assert sectors[:, 1] == pytest.approx(scan[:, 20:40].min(axis=1))


def _rows(seed: int, success: Callable[[Any, Any], Any]) -> LabelledRows:
    features = np.random.default_rng(seed).normal(size=(300, 2)).astype(np.float32)
    labels = success(features[:, :1], np.arange(5)[None])
    return LabelledRows(features, labels, np.ones((300, 5), bool))


def test_it_learns_what_odometry_tells_and_the_same_each_time() -> None:
    rows = [_rows(seed, lambda x, step: x > 0.3 * step) for seed in (0, 1, 2)]
    odds = [teach_reference(*rows[:2]).log_odds(rows[2].features, 5) for _ in range(2)]
    assert np.array_equal(odds[0], odds[1])
    assert np.mean((odds[0] > 0) == rows[2].success) > 0.95


def _sloping(rows: int, seed: int) -> LabelledRows:
    """Success by the sum of twelve features, which a tree asks about one at a time."""
    features = np.random.default_rng(seed).normal(size=(rows, 12)).astype(np.float32)
    success = np.repeat(features.sum(axis=1)[:, None] > 0, 5, axis=1)
    return LabelledRows(features, success, np.ones((rows, 5), bool))


def test_few_rows_teach_a_line() -> None:
    taught, asked = teach_reference(_sloping(40, 0), _sloping(200, 1)), _sloping(200, 2)
    assert taught.trees == 0
    area = au_roc(taught.log_odds(asked.features, 5), asked.success, asked.mask)
    assert area is not None
    assert area > 0.9


def test_candidates_are_ranked_within_their_scene() -> None:
    draw = np.random.default_rng(0)
    odds, through = draw.normal(size=(60, 1)), draw.random((60, 1)) < 0.5
    judged = np.ones((60, 1), bool)
    rows = LabelledRows(np.zeros((60, 0), np.float32), through, judged, of_a_scene=6)
    areas = scene_areas(odds.reshape(10, 6), through.reshape(10, 6), judged.reshape(10, 6))
    assert rows.area(odds) == pytest.approx(np.nanmean(areas))
    # What tells scenes apart, and not their candidates, is worth nothing.
    assert rows.area(np.repeat(draw.normal(size=10), 6)[:, None]) == 0.5


def test_without_features_it_knows_how_far_ahead_a_step_lies() -> None:
    rows = _rows(0, lambda x, step: x > 0.5 * step)
    bare = LabelledRows(rows.features[:, :0], rows.success, rows.mask)
    odds = teach_reference(bare).log_odds(bare.features, 5)
    assert 1 / (1 + np.exp(-odds[0])) == pytest.approx(rows.success.mean(axis=0), abs=0.02)
    assert np.ptp(odds, axis=0).max() == 0


def test_rows_of_one_class_teach_its_share() -> None:
    rows = _rows(0, lambda x, step: (x > -99) & (step >= 0))
    odds = teach_reference(rows).log_odds(rows.features, 5)
    assert np.ptp(odds) == 0
    assert odds[0, 0] > 5
