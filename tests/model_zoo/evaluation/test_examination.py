"""An examination: margins come from a file, and each verdict follows from figure and interval."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from graspe_data.errors import ZooError
from model_zoo.augmentation import FAILING_SENSOR, Condition
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation import evaluate
from model_zoo.evaluation.cell import Score
from model_zoo.evaluation.contestants import Contestant, contestants
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.examination import (
    Examination,
    examine,
    load_examination,
    mean_advantage,
)
from model_zoo.evaluation.examination_markdown import write_examination
from model_zoo.registry import MODELS
from pipelines.command_line import app
from tests.model_zoo.checkpoints.tiny_model import write_tiny_dataset

ASKED = Examination.model_validate(
    {
        "name": "tried",
        "needs": {"hill": "camera", "lake": "either"},
        "by_day": ["hill", "lake"],
        "taught": ["dark", "covered"],
        "strange": {"camera": "strange_camera", "lidar": "strange_lidar"},
        "control": "tiny",
        "challengers": ["other"],
        "margins": {"lead": 0.1, "need": 0.05, "gain": 0.03, "harm": 0.01},
    }
)
CONDITIONS: tuple[Condition, ...] = ("clean", "dark", "glare", "strange_camera")
ADVANTAGE = "model_zoo.evaluation.examination.mean_advantage"


@pytest.fixture
def evaluations(write_tiny: Callable[..., Path], tmp_path: Path) -> list[Evaluation]:
    """Two trainings each of a control and of a challenger."""
    data = write_tiny_dataset(tmp_path / "data", ("hill",) * 4 + ("lake",) * 4)

    def made(name: str, seed: int) -> Evaluation:
        folder = write_tiny(f"{name}{seed}", seed=seed, recipe={"seed": seed})
        found = evaluate(load_checkpoint(folder), data, conditions=CONDITIONS, resamples=60)
        return found.model_copy(update={"model": name})

    return [made("tiny", 0), made("tiny", 1), made("other", 2), made("other", 3)]


def test_the_shipped_one_knows_its_models_and_conditions() -> None:
    shipped = load_examination("study")
    assert {shipped.control, *shipped.challengers} <= {*MODELS}
    assert {*shipped.taught} <= {*FAILING_SENSOR}
    assert shipped.suffices("either_decides", "camera")
    assert shipped.suffices("lidar_decides", "camera")
    assert not shipped.suffices("camera_decides", "camera")
    assert not shipped.suffices("each_is_fooled", "lidar")
    assert not shipped.suffices("graspe_1_plants", "lidar")


def test_every_question_is_answered_for_every_place(evaluations: list[Evaluation]) -> None:
    answers = examine(contestants(evaluations), ASKED)
    assert [(a.question, a.what) for a in answers] == [
        ("lead", "hill"),
        ("lead", "lake"),
        ("need", "hill, strange camera"),
        ("gain", "camera fails, taught: dark"),
        ("gain", "camera fails, never taught: glare"),
        ("gain", "lidar fails, taught: none"),
        ("gain", "lidar fails, never taught: none"),
        ("harm", "all is sound, mean over scenarios"),
    ]
    assert [a.verdict for a in answers if "none" in a.what] == ["missing", "missing"]


def test_a_difference_is_the_mean_over_places(evaluations: list[Evaluation]) -> None:
    control, other = contestants(evaluations)
    places = [("hill", "dark"), ("lake", "dark")]
    found = mean_advantage(other, control, places)
    each = [other.advantage(control, *place).value for place in places]
    assert found.value == pytest.approx(sum(value or 0.0 for value in each) / 2)
    same = mean_advantage(control, control, places)
    assert (same.value, same.low, same.high) == (0.0, None, None)
    assert mean_advantage(other, control, [("hill", "dust")]).value is None


@pytest.mark.parametrize(
    ("score", "gain", "harm"),
    [
        ((0.04, 0.01, 0.07), "shown", "shown"),
        ((0.04, -0.02, 0.09), "undecided", "undecided"),
        ((0.02, 0.01, 0.03), "not shown", "shown"),
        ((-0.005, -0.009, 0.001), "not shown", "shown"),
        ((-0.005, -0.03, 0.02), "not shown", "undecided"),
        ((-0.02, -0.03, -0.01), "not shown", "not shown"),
        ((None, None, None), "missing", "missing"),
    ],
)
def test_a_verdict_follows_from_margin_and_interval(
    evaluations: list[Evaluation],
    monkeypatch: pytest.MonkeyPatch,
    score: tuple[float | None, ...],
    gain: str,
    harm: str,
) -> None:
    value, low, high = score
    fixed = Score(value=value, low=low, high=high)
    monkeypatch.setattr(ADVANTAGE, lambda *_: fixed)
    answers = examine(contestants(evaluations), ASKED)
    assert {a.verdict for a in answers if a.question == "gain"} == {gain}
    assert [a.verdict for a in answers if a.question == "harm"] == [harm]


def test_the_document_shows_margins_answers_and_cells(
    evaluations: list[Evaluation], tmp_path: Path
) -> None:
    file, _ = write_examination(evaluations, ASKED, tmp_path / "out")
    text = file.read_text()
    for expected in (
        "# Examination `tried`",
        "the best model leads the best blind reference by at least 0.1",
        "it gains at least 0.03 on `tiny` where one sensor fails",
        "## `hill`: its hazards need the camera",
        "## `lake`: its hazards need either sensor",
        "| model | clean | dark (camera, taught) | glare (camera) | strange camera |",
        "blind: constant",
    ):
        assert expected in text


def test_without_its_control_nothing_is_answered(evaluations: list[Evaluation]) -> None:
    with pytest.raises(ZooError, match="the control tiny is not among the models"):
        examine(contestants(evaluations[2:]), ASKED)


def test_of_models_that_share_a_name_the_first_is_asked(evaluations: list[Evaluation]) -> None:
    models = contestants(evaluations)
    models.append(Contestant.of("other (recipe x)", models[1].runs))
    asked = {a.model for a in examine(models, ASKED) if a.question == "gain"}
    assert asked == {"other"}


def test_the_command_counts_the_verdicts(evaluations: list[Evaluation], tmp_path: Path) -> None:
    files = []
    for number, evaluation in enumerate(evaluations):
        files.append(tmp_path / f"{number}.json")
        evaluation.write(files[-1])
    asked = tmp_path / "asked.yaml"
    asked.write_text(ASKED.model_dump_json())
    words = ["zoo", "examine", *files, "--examination", asked, "--out", tmp_path / "out"]
    said = CliRunner().invoke(app, [str(word) for word in words])
    assert said.exit_code == 0, said.output
    assert "examination.md: " in said.output
    assert "2 missing" in said.output
