from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

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

    def build(
        seed: int, name: str = "tiny", trained: dict[str, Any] | None = None, **changed: object
    ) -> Evaluation:
        checkpoint = load_checkpoint(write_tiny(f"{name}{seed}", seed=seed, **(trained or {})))
        arguments = {"conditions": ("clean", "dark"), "resamples": 40} | changed
        found = evaluate(checkpoint, data, **arguments)  # type: ignore[arg-type]
        return found.model_copy(update={"model": name})

    return build


def recipe(seed: int, **changed: object) -> dict[str, Any]:
    return {"recipe": {"epochs": 2, "seed": seed} | changed}


def test_tables_csv_and_plots_are_written(make: Make, tmp_path: Path) -> None:
    table = compare([make(0), make(1, "other")], tmp_path / "out")
    text = table.read_text()
    for told in (
        "| model | all | hill | lake |",
        "## AU-ROC less that of tiny, on the same resamples",
        "| model | clean | dark |",
        "## Cost of one prediction",
        "| lake | 2 | ",
        "60 rows of 5 recordings, every judged row.",
        "intervals over recordings, not over trainings",
        "| tiny | small | 1 | not said | 0 | 7 | ",
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
    assert one.recipe is not None
    table = compare([one], tmp_path / "out")
    with table.with_name("comparison.csv").open() as file:
        lines = list(csv.DictReader(file))
    places, parts = 3 * 2, 2 * (9 + 2 + 2)
    # Five parts of all rows have no AU-ROC here: nothing stands or backs, what fails fails at once.
    leads = parts - 2 * 5
    # Six scores and, of other rows than those not failing yet, AU-ROC; the leads; the costs.
    own = [line for line in lines if line["model"] == "tiny"]
    assert len([line for line in own if line["metric"] == "lead"]) == leads
    assert len(own) == places * 6 + (parts - places) + leads + 5
    blind = [line for line in lines if line["model"].startswith("blind: ")]
    assert lines[: len(blind)] == blind
    assert len(lines) == len(blind) + len(own)
    assert len(blind) == 4 * parts
    area = next(
        line
        for line in lines
        if (line["model"], line["scenario"], line["condition"], line["metric"], line["rows"])
        == ("tiny", "hill", "dark", "au_roc", "not_failing")
    )
    cell = one.cell("hill", "dark")
    assert cell is not None
    assert float(area["value"]) == cell.scores["au_roc"].value
    assert float(area["low"]) == cell.scores["au_roc"].low
    assert (area["recipe"], area["trained_on"]) == (one.recipe.digest, "ab" * 32)
    assert (area["split"], area["every"], area["recordings"]) == ("test", "1", "3")


def test_the_same_evaluations_give_the_same_bytes(make: Make, tmp_path: Path) -> None:
    evaluations = [make(0), make(1, "other")]
    first, second = (compare(evaluations, tmp_path / out).parent for out in ("a", "b"))
    for file in first.iterdir():
        assert file.read_bytes() == (second / file.name).read_bytes()


def test_trainings_with_other_seeds_are_averaged(make: Make, tmp_path: Path) -> None:
    runs = [make(seed, trained=recipe(seed)) for seed in range(3)]
    (model,) = contestants(runs)
    areas = model.values("au_roc", "all", "clean")
    assert model.score("au_roc", "all", "clean").value == pytest.approx(sum(areas) / 3)
    text = compare(runs, tmp_path / "out").read_text()
    assert "means over the trainings" in text
    assert "less that of" not in text
    assert "| tiny | small | 3 | not said | 0, 1, 2 | 7, 7, 7 | " in text


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


def test_recipes_and_training_data_are_told_apart(make: Make) -> None:
    plain, longer = make(0, trained=recipe(0)), make(0, trained=recipe(0, epochs=9))
    elsewhere = make(0, trained=recipe(0) | {"dataset_digest": "cd" * 32})
    found = contestants([plain, longer, elsewhere, make(1, trained=recipe(1))])
    assert [model.label for model in found] == [
        "tiny (epochs 2, data abababab)",
        "tiny (epochs 9, data abababab)",
        "tiny (epochs 2, data cdcdcdcd)",
    ]
    assert [len(model.runs) for model in found] == [2, 1, 1]


def test_a_recipe_that_is_not_known_is_a_recipe_of_its_own(make: Make) -> None:
    older = make(1, trained=recipe(1)).model_copy(update={"recipe": None})
    known = make(0, trained=recipe(0))
    labels = [model.label for model in contestants([known, older])]
    assert known.recipe is not None
    assert labels == [f"tiny (recipe {known.recipe.short})", "tiny (recipe unknown)"]


def test_names_are_drawn_and_printed_as_they_are(make: Make, tmp_path: Path) -> None:
    odd = [make(0).model_copy(update={"model": name}) for name in ("$x_{" * 50, "_a|b\n<i>")]
    odd[1] = odd[1].model_copy(update={"checkpoint": "1" * 64})
    assert "| _a\\|b &lt;i> |" in compare(odd, tmp_path / "out").read_text()


def test_one_class_is_said_to_leave_au_roc_undefined(
    make: Make, write_tiny: Callable[..., Path], tmp_path: Path
) -> None:
    data = write_tiny_dataset(tmp_path / "good", ("hill", "hill"), success=True)
    one = evaluate(load_checkpoint(write_tiny()), data, conditions=("clean", "dark"), resamples=9)
    text = compare([one], tmp_path / "out").read_text()
    assert "- hill: AU-ROC undefined: all judged steps succeed" in text


def test_trainings_of_one_seed_are_no_repetitions(make: Make) -> None:
    one, same = make(0), make(0, trained={"metrics": {"steps": 8}})
    with pytest.raises(ZooError, match=r"tiny \(small, seed 0\) is there twice, .*one recipe"):
        contestants([one, same])
    older = [run.model_copy(update={"recipe": None}) for run in (one, same)]
    with pytest.raises(ZooError, match="recipes that their evaluations do not tell"):
        contestants(older)
    with pytest.raises(ZooError, match="differ in parameters: 31 and 30"):
        contestants([one, make(1).model_copy(update={"parameters": 31, "recipe": one.recipe})])
    with pytest.raises(ZooError, match="other settings under the name of one preset"):
        contestants([one, make(2).model_copy(update={"settings": "0" * 64})])


def test_other_rows_are_refused(make: Make) -> None:
    one, other = make(0), make(1)
    fewer = [cell.model_copy(update={"rows": cell.rows - 1}) for cell in other.cells]
    with pytest.raises(ZooError, match=r"differ in the rows of 'all' under 'clean': .*rows 54"):
        contestants([one, other.model_copy(update={"cells": tuple(fewer)})])


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
