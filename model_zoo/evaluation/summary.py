"""What an evaluation came to, for the terminal: the blind references, then the model."""

from __future__ import annotations

from model_zoo.evaluation.blind_features import TITLES as REFERENCE_TITLES
from model_zoo.evaluation.cell import Cell, Part, ReferenceCell, Score
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.parts import NOT_FAILING, TITLES, in_order


def render_summary(evaluation: Evaluation) -> str:
    """AU-ROC of all scenarios under the first condition, part by part, as lines of text."""
    condition = evaluation.conditions[0]
    whole = evaluation.cell(condition=condition)
    if whole is None:
        return "nothing judged"
    lines = [f"AU-ROC, {condition} sensors, {_counted(whole)}"]
    named: list[tuple[str, Cell | ReferenceCell | None]] = [
        (reference.title, reference.cell(condition=condition))
        for reference in evaluation.references.scores
    ]
    width = max(len(name) for name, _ in [*named, (evaluation.model, None)])
    lines += [_line(name, width, cell) for name, cell in named]
    lines += [_line(evaluation.model, width, whole), ""]
    lines += [f"{TITLES[name]}: {_shown(whole.parts[name])}" for name in in_order(whole.parts)]
    return "\n".join(lines)


def _counted(cell: Cell) -> str:
    counted = f"{cell.rows:,} rows not failing yet of {cell.recordings} recordings"
    return counted if cell.only_class is None else f"{counted}; undefined: {cell.only_class}"


def _line(name: str, width: int, cell: Cell | ReferenceCell | None) -> str:
    return f"{name:{width}}  {_score(cell.parts[NOT_FAILING].au_roc) if cell else '-'}"


def _shown(part: Part) -> str:
    lead = part.lead
    text = f"{_score(part.au_roc)} on {part.rows:,} rows"
    if lead is None:
        return text
    over = REFERENCE_TITLES[lead.reference]
    return f"{text}; lead over {over.removeprefix('blind: ')}: {_score(lead, '+.3f')}"


def _score(score: Score, form: str = ".3f") -> str:
    if score.value is None:
        return "undefined"
    text = f"{score.value:{form}}"
    if score.low is None or score.high is None:
        return text
    return f"{text} [{score.low:{form}}, {score.high:{form}}]"
