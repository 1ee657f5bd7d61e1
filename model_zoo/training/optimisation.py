"""One step: a batch moves the weights, at a rate and by chance that follow from its number."""

from __future__ import annotations

import hashlib
import math

import torch
from lightning_fabric import Fabric
from torch import Tensor, nn

from model_zoo.batches import Batch
from model_zoo.contract import CANDIDATE_MASK, DRIVEN, Observation, SuccessModel
from model_zoo.labels import MASK, SUCCESS
from model_zoo.training.candidates import join_candidates, ranking_loss
from model_zoo.training.recipe import Recipe
from model_zoo.training.rows import RowWeights


def step_seed(seed: int, step: int, rank: int = 0) -> int:
    """A seed for torch's generators, set before every step.

    What a step draws, dropout for one, so does not depend on the steps before it: a run that goes
    on from a saved state needs no generator's state, and draws what the whole run would have.

    Args:
        seed: The recipe's.
        step: Steps done before it; -1 for the weights of the model.
        rank: This process; ranks draw differently.

    Returns:
        63 bits.
    """
    text = f"graspe training step 1\0{seed}\0{step}\0{rank}"
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def learning_rate(recipe: Recipe, step: int, steps: int) -> float:
    """The rate at a step: a pure function, so there is no scheduler's state to save.

    Args:
        recipe: Highest rate, schedule and warm-up.
        step: Counted from 0.
        steps: Of the whole training.
    """
    # Linear from zero over the warm-up, then constant or half a cosine down to zero.
    warmed = min(1.0, (step + 1) / (recipe.warm_up_steps + 1))
    if recipe.schedule == "constant":
        return recipe.learning_rate * warmed
    done = max(0, step - recipe.warm_up_steps) / max(1, steps - recipe.warm_up_steps)
    return recipe.learning_rate * warmed * (1 + math.cos(math.pi * done)) / 2


class Optimisation:
    """A model, its optimiser, and the ranks that share them.

    Attributes:
        model: Not wrapped.
        adam: Its optimiser, not wrapped.
    """

    def __init__(
        self, fabric: Fabric, model: SuccessModel, recipe: Recipe, weights: RowWeights
    ) -> None:
        """Move the model to the rank's device, and to the other ranks' weights."""
        self._fabric, self._recipe, self._weights = fabric, recipe, weights
        self.model = model
        self.adam = torch.optim.Adam(
            [weight for weight in model.parameters() if weight.requires_grad],
            lr=recipe.learning_rate,
            weight_decay=recipe.weight_decay,
        )
        self._module, self._optimiser = fabric.setup(_LossModule(model, recipe.ranking), self.adam)

    def step(self, batch_on_cpu: Batch, step: int, steps: int) -> dict[str, Tensor]:
        """Do one step, in training mode; what it draws follows from seed, step and rank.

        Args:
            batch_on_cpu: A batch on the CPU.
            step: Steps done before.
            steps: Of the whole training.

        Returns:
            Scalars: ``loss``, its parts, and ``gradient_length`` before it was clipped.
        """
        fabric, recipe = self._fabric, self._recipe
        torch.manual_seed(step_seed(recipe.seed, step, fabric.global_rank))
        self._module.train()
        for group in self.adam.param_groups:
            group["lr"] = learning_rate(recipe, step, steps)
        loss, parts = self._module(*self._arguments(fabric.to_device(batch_on_cpu)))
        self._optimiser.zero_grad(set_to_none=True)
        fabric.backward(loss)
        limit = recipe.gradient_clip or float("inf")
        length = nn.utils.clip_grad_norm_(self._module.parameters(), limit)
        self._optimiser.step()
        return {**parts, "loss": loss.detach(), "gradient_length": length}

    def _arguments(self, batch: Batch) -> tuple[Observation, Tensor, Tensor, Tensor]:
        """The model's columns alone, labels, mask and weights."""
        observation = {name: batch[name] for name in self.model.columns}
        if CANDIDATE_MASK not in batch:
            success, mask = batch[SUCCESS].float(), batch[MASK].bool()
            return observation, success, mask, self._weights.of(success, mask)
        observation[DRIVEN], success, mask, share = join_candidates(batch)
        return observation, success, mask, self._weights.of(success, mask) * share


class _LossModule(nn.Module):
    """A model whose forward pass is its loss, as wrappers of modules expect."""

    def __init__(self, model: SuccessModel, ranking: float) -> None:
        super().__init__()
        self.model, self._ranking = model, ranking

    def forward(
        self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor
    ) -> tuple[Tensor, dict[str, Tensor]]:
        loss = self.model.loss(observation, success, mask, weight)
        total, parts = loss.total, {name: part.detach() for name, part in loss.parts.items()}
        if self._ranking and self.model.candidate_columns:
            scenes = len(observation[self.model.scene_columns[0]])
            order = ranking_loss(loss.logits, success, mask, scenes)
            total = total + self._ranking * loss.entropy_scale * order
            parts["ranking"] = order.detach()
        return total, parts
