"""Scores in tables of Markdown: with their intervals, the best of a column in bold."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from model_zoo.evaluation.cell import Score
from model_zoo.evaluation.entrants import Entrant


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; what a text holds of Markdown's or HTML's own signs is shown as it is."""
    lines = [[_escaped(text) for text in line] for line in (head, *rows)]
    lines.insert(1, ["---" for _ in head])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _escaped(text: str) -> str:
    plain = " ".join(text.split())
    return plain.replace("|", "\\|").replace("<", "&lt;")


def score_grid(
    models: Sequence[Entrant],
    columns: Sequence[str],
    score: Callable[[Entrant, str], Score],
    *,
    higher_is_better: bool = True,
    titles: Sequence[str] | None = None,
) -> str:
    """A table of scores: a row for each entrant, the best of a column in bold.

    Args:
        models: The rows.
        columns: What stands in each column, for ``score``.
        score: Of an entrant in a column.
        higher_is_better: Which is the best.
        titles: Of the columns, where they are not their names.
    """
    texts = [
        emphasised([score(model, c) for model in models], higher_is_better=higher_is_better)
        for c in columns
    ]
    labels = [model.label for model in models]
    rows = [list(row) for row in zip(labels, *texts, strict=True)]
    return markdown_table(["model", *(titles or columns)], rows)


def emphasised(scores: Sequence[Score], *, higher_is_better: bool) -> list[str]:
    """Scores as text with their intervals, the best in bold."""
    values = [round(score.value, 3) for score in scores if score.value is not None]
    best = (max if higher_is_better else min)(values, default=None)
    several = len(values) > 1
    return [
        _shown(score, bold=several and score.value is not None and round(score.value, 3) == best)
        for score in scores
    ]


def _shown(score: Score, *, bold: bool = False, form: str = ".3f") -> str:
    if score.value is None:
        return "-"
    value = f"{score.value:{form}}".replace("-0.000", "0.000")
    text = f"**{value}**" if bold else value
    if score.low is None or score.high is None:
        return text
    return f"{text} [{score.low:{form}}, {score.high:{form}}]"


def signed(score: Score) -> str:
    """A difference as text, with its sign and its interval."""
    return _shown(score, form="+.3f")
