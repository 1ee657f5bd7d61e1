"""The model card: what a checkpoint is, for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import JsonValue

from model_zoo.checkpoints.calibration import Calibration
from model_zoo.checkpoints.config import CheckpointConfig

_CARD = """\
# {model} ({preset})

Predicts from one observation of a ground robot how likely the trajectory it is about to drive is to
succeed, step by step: probabilities (batch, {horizon}), 1 = success.

{parameters:,} parameters. Trained on the dataset `{dataset_digest}`.

## It reads

| column | dtype | shape of a row |
| --- | --- | --- |
{columns}

## Scores on the validation rows

{metrics}

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

    from pathlib import Path
    from model_zoo.checkpoints import load_checkpoint
    probability = load_checkpoint(Path("this folder")).predict(observation)
"""


def render_card(
    config: CheckpointConfig,
    recipe: Mapping[str, JsonValue],
    environment: Mapping[str, JsonValue],
    metrics: Mapping[str, JsonValue],
    calibration: Calibration | None,
) -> str:
    """The card as Markdown."""
    columns = [f"| {c.name} | {c.dtype} | {c.shape or '()'} |" for c in config.columns]
    return _CARD.format(
        model=config.model,
        preset=config.preset,
        horizon=config.horizon,
        parameters=config.parameters,
        dataset_digest=config.dataset_digest,
        columns="\n".join(columns),
        metrics=_bullets(metrics),
        calibration=_describe(calibration),
        recipe=_bullets(recipe),
        environment=_bullets(environment),
    )


def _describe(calibration: Calibration | None) -> str:
    if calibration is None:
        return "None: probabilities are the sigmoid of the logits."
    return (
        f"Logits are divided by the temperature {calibration.temperature:.3f}, fitted on "
        f"{calibration.judged:,} validation steps; it took their cross-entropy from "
        f"{calibration.loss_before:.4f} to {calibration.loss_after:.4f}."
    )


def _bullets(content: Mapping[str, Any], prefix: str = "") -> str:
    """Nested mappings as one list of dotted keys."""
    lines = []
    for key, value in content.items():
        if isinstance(value, Mapping):
            lines.append(_bullets(value, f"{prefix}{key}."))
        else:
            shown = f"{value:.4g}" if isinstance(value, float) else value
            lines.append(f"- {prefix}{key}: {shown}")
    return "\n".join(line for line in lines if line) or "- none"
