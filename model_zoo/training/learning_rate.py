"""The learning rate of each step."""

from __future__ import annotations

import math

from model_zoo.training.recipe import Recipe


def learning_rate(recipe: Recipe, step: int, steps: int) -> float:
    """The rate at a step: a pure function, so there is no scheduler's state to save.

    Args:
        recipe: Highest rate, schedule and warm-up.
        step: Counted from 0.
        steps: Of the whole training.
    """
    warmed = min(1.0, (step + 1) / (recipe.warm_up_steps + 1))
    if recipe.schedule == "constant":
        return recipe.learning_rate * warmed
    done = max(0, step - recipe.warm_up_steps) / max(1, steps - recipe.warm_up_steps)
    return recipe.learning_rate * warmed * (1 + math.cos(math.pi * done)) / 2
