"""What a training came to, in a line."""

from __future__ import annotations

from model_zoo.checkpoints.calibration import Calibration, Uncalibrated
from model_zoo.training.history import best_epoch
from model_zoo.training.recipe import Recipe
from model_zoo.training.state import TrainingState


def summarise(
    state: TrainingState, recipe: Recipe, steps: int, calibration: Calibration | Uncalibrated
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
