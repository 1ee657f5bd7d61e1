"""The end of a training: scores, calibration, checkpoint, and what it came to in a line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import JsonValue

from model_zoo.checkpoints.calibration import TemperatureScaling, Uncalibrated, fit_temperature
from model_zoo.checkpoints.write import TrainedModel, write_checkpoint
from model_zoo.contract import SuccessModel
from model_zoo.metrics import METRICS
from model_zoo.training.data import TrainingData
from model_zoo.training.machine import Session
from model_zoo.training.recipe import Recipe
from model_zoo.training.state import Identity, TrainingState, best_epoch
from model_zoo.training.validation import Predictions, predict


def publish(
    session: Session,
    model: SuccessModel,
    data: TrainingData,
    identity: Identity,
    state: TrainingState,
    folder: Path,
) -> TemperatureScaling | Uncalibrated:
    """Score the model on the validation rows and write its checkpoint.

    Rank 0 writes; all go on once it is there.

    Args:
        session: Its ranks; it hears of the validation.
        model: With its best weights.
        data: What it was trained on.
        identity: Of the training.
        state: What it came to.
        folder: Of the checkpoint.

    Returns:
        How its logits become probabilities.

    Raises:
        ZooError: It cannot be written.
    """
    predictions = predict(session.fabric, model, data.validation, session.progress)
    calibration = fit_temperature(*predictions.of(predictions.calibrating))
    if session.fabric.is_global_zero:
        trained = TrainedModel(
            model_name=identity.model,
            preset=identity.preset,
            numbers=identity.numbers,
            model=model,
            columns=data.columns,
            recipe=identity.recipe.model_dump(mode="json"),
            dataset_digest=identity.dataset,
            metrics=_metrics(predictions, calibration, state, data.halves),
            calibration=calibration,
            assumptions=data.assumptions,
            begins_from=identity.begins_from,
            lineage=data.lineage,
        )
        write_checkpoint(folder, trained)
    session.fabric.barrier()
    return calibration


def _metrics(
    predictions: Predictions,
    calibration: TemperatureScaling | Uncalibrated,
    state: TrainingState,
    halves: str,
) -> dict[str, JsonValue]:
    """Scores of the checkpoint on the validation rows that select, and the epochs it is one of.

    All but ``loss``, which is that of the epoch, are of the calibrated model.
    """
    temperature = calibration.temperature if isinstance(calibration, TemperatureScaling) else 1.0
    logits, *labels = predictions.of(predictions.selecting)
    scored = (logits / temperature, *labels)
    timing = {"seconds", "samples_per_s", "data_wait_share"}
    return {
        **{name: score(*scored) for name, score in METRICS.items()},
        "validation": halves,
        "rows_selecting": int(np.count_nonzero(predictions.selecting)),
        "rows_calibrating": int(np.count_nonzero(predictions.calibrating)),
        "loss": predictions.loss(),
        "best_epoch": best_epoch(state.history),
        "epochs": len(state.history),
        "steps": state.step,
        "history": [record.model_dump(mode="json", exclude=timing) for record in state.history],
    }


def summarise(
    state: TrainingState, recipe: Recipe, steps: int, calibration: TemperatureScaling | Uncalibrated
) -> str:
    """Why it ended, its best epoch, and how probabilities come of its logits."""
    best = state.history[best_epoch(state.history)]
    if state.step < steps:
        why = "no better for the recipe's patience"
    elif steps == recipe.most_steps:
        why = f"stopped by the recipe's most_steps, {steps}"
    else:
        why = "all steps done"
    return (
        f"{why}; best of the {len(state.history)} epochs, counted from 0: {best.epoch}, validation "
        f"AU-ROC {best.au_roc:.4f}; {calibration}"
    )
