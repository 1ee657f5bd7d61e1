"""The examination as Markdown: what was asked, the answers, and every cell of the table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ZooError
from model_zoo.augmentation import FAILING_SENSOR
from model_zoo.evaluation.comparison_heading import render_heading
from model_zoo.evaluation.comparison_markdown import entrants_of
from model_zoo.evaluation.contestants import Contestant, contestants
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.examination import Answer, Examination, examine
from model_zoo.evaluation.score_tables import markdown_table, score_grid, signed

FILE = "examination.md"
_ASKED = {
    "lead": "the best model leads the best blind reference by at least {lead:g}",
    "need": "a strange sensor costs at least {need:g} where the scenario needs it",
    "gain": "it gains at least {gain:g} on `{control}` where one sensor fails and the other "
    "suffices, interval above 0",
    "harm": "it loses at most {harm:g} to `{control}` where all is sound",
}


def write_examination(
    evaluations: Sequence[Evaluation], asked: Examination, out: Path
) -> tuple[Path, list[Answer]]:
    """Write ``examination.md`` atomically.

    Returns:
        The file, and the answers.

    Raises:
        ZooError: The evaluations cannot be compared, or the folder cannot be written.
    """
    models = contestants(evaluations)
    answers = examine(models, asked)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ZooError(f"{out}: cannot be made: {error.strerror}.") from error
    text = render_examination(models, asked, answers)
    write_atomically(out / FILE, [text.encode()], ZooError)
    return out / FILE, answers


def render_examination(
    models: Sequence[Contestant], asked: Examination, answers: Sequence[Answer]
) -> str:
    """The document."""
    heading = render_heading(models).replace("# Comparison", f"# Examination `{asked.name}`")
    parts = [
        heading.replace("graspe zoo compare", "graspe zoo examine"),
        "## What was asked, and the answers",
        _answers(asked, answers),
    ]
    for scenario in _scenarios(models, asked):
        parts += _factorial(models, asked, scenario)
    return "\n\n".join(parts) + "\n"


def _answers(asked: Examination, answers: Sequence[Answer]) -> str:
    margins = asked.margins.model_dump() | {"control": asked.control}
    rows = [
        (
            _ASKED[answer.question].format(**margins),
            answer.what,
            answer.model,
            signed(answer.score),
            answer.verdict,
        )
        for answer in answers
    ]
    return markdown_table(("asked", "where", "model", "difference", "answer"), rows)


def _scenarios(models: Sequence[Contestant], asked: Examination) -> list[str]:
    """Those of which it is known what they need first, then the others."""
    there = models[0].runs[0].scenarios
    known = [name for name in asked.needs if name in there]
    return known + [name for name in there if name not in asked.needs]


def _factorial(models: Sequence[Contestant], asked: Examination, scenario: str) -> tuple[str, str]:
    """One scenario: models and blind references by condition."""
    conditions = models[0].runs[0].conditions
    need = asked.needs.get(scenario)
    title = f"## `{scenario}`" + (f": its hazards need {_NEEDS[need]}" if need else "")
    table = score_grid(
        entrants_of(models),
        conditions,
        lambda entrant, condition: entrant.au_roc(scenario, condition),
        titles=[_title(condition, asked) for condition in conditions],
    )
    return title, table


_NEEDS = {
    "camera": "the camera",
    "lidar": "the lidar",
    "either": "either sensor",
    "both": "both sensors",
}


def _title(condition: str, asked: Examination) -> str:
    sensors = {str(name): sensor for name, sensor in FAILING_SENSOR.items()}
    sensor, name = sensors.get(condition), condition.replace("_", " ")
    if sensor is None:
        return name
    if condition in asked.strange.values():
        return name
    return f"{name} ({sensor}{', taught' if condition in asked.taught else ''})"
