"""The model card: what a checkpoint is, for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import JsonValue

from model_zoo.checkpoints.calibration import TemperatureScaling, Uncalibrated
from model_zoo.checkpoints.config import CheckpointConfig

_HISTORY = "history"
_CARD = """\
# {model} ({preset})

Predicts from one observation of a ground robot how likely the trajectory it is about to drive is to
succeed, step by step: probabilities (batch, {horizon}), 1 = success.

{parameters:,} parameters. Trained on the dataset `{dataset_digest}`.{beginning}

## It reads

| column | dtype | shape of a row |
| --- | --- | --- |
{columns}

## Scores on the validation rows

{metrics}

{history}

These rows chose the weights, so the scores are optimistic: judge the model by an evaluation on
rows of worlds and days that it has not seen.

## Calibration

{calibration}

## Training

{recipe}

Environment:

{environment}

## Use and limits

Made to rank and to reject candidate trajectories of the robot, sensors and surroundings that the
dataset shows; elsewhere its probabilities mean little. It is no safety system: a planner must stop
for obstacles without it. Degraded sensors lower its skill; see the evaluation by condition.

    from graspe_data.shards import Dataset
    from model_zoo.checkpoints import load_checkpoint

    checkpoint = load_checkpoint("this folder")
    rows = Dataset("a dataset", "test", columns=checkpoint.model.columns)
    probability = checkpoint.predict(rows.batch(range(8)))
"""


def render_card(
    config: CheckpointConfig,
    recipe: Mapping[str, JsonValue],
    environment: Mapping[str, JsonValue],
    metrics: Mapping[str, JsonValue],
    calibration: TemperatureScaling | Uncalibrated | None,
) -> str:
    """The card as Markdown."""
    columns = [f"| {c.name} | {c.dtype} | {c.shape or '()'} |" for c in config.columns]
    return _CARD.format(
        model=config.model,
        preset=config.preset,
        horizon=config.horizon,
        parameters=config.parameters,
        dataset_digest=config.dataset_digest,
        beginning=_beginning(config),
        columns="\n".join(columns),
        metrics=_bullets({name: value for name, value in metrics.items() if name != _HISTORY}),
        history=_epochs(metrics.get(_HISTORY)),
        calibration=_describe(calibration),
        recipe=_bullets(recipe),
        environment=_bullets(environment),
    )


def _beginning(config: CheckpointConfig) -> str:
    begun = config.begins_from
    if begun is None:
        return ""
    return f"\nIt goes on from the checkpoint `{begun.checkpoint}`, after {begun.step:,} steps."


def _describe(calibration: TemperatureScaling | Uncalibrated | None) -> str:
    if not isinstance(calibration, TemperatureScaling):
        why = "" if calibration is None else f" {calibration.reason.capitalize()}."
        return f"None: probabilities are the sigmoid of the logits.{why}"
    bound = " It is the bound: the fit would go beyond." if calibration.at_bound else ""
    return (
        f"Logits are divided by the temperature {calibration.temperature:.3f}, fitted on "
        f"{calibration.judged:,} validation steps; it took their cross-entropy from "
        f"{calibration.loss_before:.4f} to {calibration.loss_after:.4f}.{bound}"
    )


def _bullets(content: Mapping[str, Any]) -> str:
    """A line for each value, nested ones by dotted keys."""
    lines = [f"- {name}: {_text(value)}" for name, value in _flat(content).items()]
    return "\n".join(lines) or "- none"


def _epochs(history: Any) -> str:
    """A table with a line for each epoch; nothing where there is no history."""
    records = history if isinstance(history, list) else []
    rows = [_flat(record) for record in records if isinstance(record, Mapping)]
    names = list(dict.fromkeys(name for row in rows for name in row))
    if not names:
        return "Epoch by epoch nothing is known."
    lines = [names, ["---"] * len(names)]
    lines += [[_text(row.get(name)) for name in names] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _flat(content: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mappings as one of dotted keys."""
    flat: dict[str, Any] = {}
    for key, value in content.items():
        name = f"{prefix}{key}"
        flat |= _flat(value, f"{name}.") if isinstance(value, Mapping) else {name: value}
    return flat


def _text(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value)
    return f"{value:.4g}" if isinstance(value, float) else f"{value}"
