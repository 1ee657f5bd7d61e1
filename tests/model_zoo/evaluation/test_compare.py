from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.image import imread

from graspe_data.errors import ZooError
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation import compare, evaluate
from model_zoo.evaluation.contestants import contestants
from model_zoo.evaluation.evaluation import Evaluation
from tests.model_zoo.checkpoints.tiny_model import write_tiny_dataset

Make = Callable[..., Evaluation]


@pytest.fixture
def make(write_tiny: Callable[..., Path], tmp_path: Path) -> Make:
    """An evaluation of a tiny model that was trained with a seed."""
    data = write_tiny_dataset(tmp_path / "data", ("hill", "hill", "hill", "lake", "lake"))

    def build(seed: int, name: str = "tiny", **changed: object) -> Evaluation:
        checkpoint = load_checkpoint(write_tiny(f"{name}{seed}", seed=seed))
        arguments = {"conditions": ("clean", "dark"), "resamples": 40} | changed
        found = evaluate(checkpoint, data, **arguments)  # type: ignore[arg-type]
        return found.model_copy(update={"model": name})

    return build


def test_tables_csv_and_plots_are_written(make: Make, tmp_path: Path) -> None:
    table = compare([make(0), make(1, "other")], tmp_path / "out")
    text = table.read_text()
    for told in (
        "| model | all | hill | lake |",
        "## AU-ROC less that of tiny, on the same resamples",
        "| model | clean | dark |",
        "## Cost of one prediction",
        "| lake | 2 | ",
        "## AU-ROC lost to each condition",
        "![roc.png](roc.png)",
    ):
        assert told in text
    for plot in ("roc.png", "calibration.png", "conditions.png"):
        assert imread(table.with_name(plot)).std() > 0.01
    assert sorted(path.suffix for path in table.parent.iterdir()) == [
        ".csv",
        ".md",
        ".png",
        ".png",
        ".png",
        ".yaml",
    ]


def test_the_csv_has_a_line_for_each_number(make: Make, tmp_path: Path) -> None:
    one = make(0)
    table = compare([one], tmp_path / "out")
    with table.with_name("comparison.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 3 * 2 * 6 + 5
    area = next(
        line
        for line in lines
        if (line["scenario"], line["condition"], line["metric"]) == ("hill", "dark", "au_roc")
    )
    cell = one.cell("hill", "dark")
    assert cell is not None
    assert float(area["value"]) == cell.scores["au_roc"].value
    assert float(area["low"]) == cell.scores["au_roc"].low


def test_the_same_evaluations_give_the_same_bytes(make: Make, tmp_path: Path) -> None:
    evaluations = [make(0), make(1, "other")]
    first, second = (compare(evaluations, tmp_path / out).parent for out in ("a", "b"))
    for file in first.iterdir():
        assert file.read_bytes() == (second / file.name).read_bytes()


def test_trainings_with_other_seeds_are_averaged(make: Make, tmp_path: Path) -> None:
    runs = [make(0), make(1), make(2)]
    (model,) = contestants(runs)
    areas = model.values("au_roc", "all", "clean")
    assert model.score("au_roc", "all", "clean").value == pytest.approx(sum(areas) / 3)
    text = compare(runs, tmp_path / "out").read_text()
    assert "means over the trainings" in text
    assert "less that of" not in text


def test_differences_are_of_the_same_resamples(make: Make) -> None:
    first, second = contestants([make(0), make(1, "other")])
    itself = first.advantage(first, "all", "clean")
    assert (itself.value, itself.low) == (0, None)
    there, back = (
        first.advantage(second, "all", "clean"),
        second.advantage(first, "all", "clean"),
    )
    assert there.value == pytest.approx(-(back.value or 0))
    assert there.low is not None
    assert there.high is not None
    assert back.low == pytest.approx(-there.high)
    assert there.low <= there.high


def test_presets_are_told_apart(make: Make) -> None:
    paper = make(1).model_copy(update={"preset": "paper"})
    assert [model.label for model in contestants([make(0), paper])] == [
        "tiny (small)",
        "tiny (paper)",
    ]


def test_what_cannot_be_compared_is_refused(make: Make, tmp_path: Path) -> None:
    one = make(0)
    with pytest.raises(ZooError, match="no evaluations given"):
        compare([], tmp_path)
    with pytest.raises(ZooError, match=r"tiny \(small, seed 0\) is given twice"):
        compare([one, one], tmp_path)
    other = make(1).model_copy(update={"dataset": "0" * 64})
    with pytest.raises(ZooError, match="differ in dataset: 0000"):
        compare([one, other], tmp_path)
    with pytest.raises(ZooError, match="differ in conditions"):
        compare([one, make(2, conditions=("clean",))], tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(ZooError, match="cannot be made"):
        compare([one], tmp_path / "file")
