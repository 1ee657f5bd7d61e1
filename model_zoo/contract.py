"""What every model of the zoo is: observation columns in, success probabilities out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn.functional import binary_cross_entropy_with_logits

from graspe_data.manifest import Settings

Observation = Mapping[str, Tensor]
"""Columns of B rows as they lie in a dataset, by name; see the README's table of columns."""

DRIVEN = "trajectory_image"
"""The column that differs between the candidates in a scene."""

CANDIDATE_IMAGE, CANDIDATE_SUCCESS, CANDIDATE_MASK = CANDIDATE_COLUMNS = (
    "candidate_image",
    "candidate_success",
    "candidate_mask",
)
"""What a simulated dataset knows of other trajectories of its rows."""

Features = dict[str, Tensor]
"""What a model makes of a scene, by name: each (B, ...)."""


@dataclass(frozen=True)
class Loss:
    """What a batch costs.

    Attributes:
        total: To be minimised, a scalar.
        logits: The log-odds of success (B n, T) that it was made of.
        parts: Scalars, by name.
        entropy_scale: What a mean cross-entropy of 1 adds to the total.
    """

    total: Tensor
    logits: Tensor
    parts: dict[str, Tensor] = field(default_factory=dict)
    entropy_scale: float = 1.0


class SuccessModel(nn.Module, ABC):
    """Predicts whether a trajectory succeeds, step by step.

    What it makes of the scene is apart from what it makes of a candidate trajectory in it, so that
    a planner encodes a scene once and scores any number of candidates. Training takes both in a
    row, by the same two functions.

    Attributes:
        name: By which the registry, presets, checkpoints and bundles know it; a class without one
            is no model of the zoo.
        settings_type: Of its numbers; the class is called with an object of it.
        columns: Names of the dataset's columns that it needs; no others are read.
        candidate_columns: Those of them that :meth:`score` reads, the others :meth:`encode`.
        horizon: Steps predicted, T.
    """

    name: ClassVar[str]
    settings_type: ClassVar[type[Settings]]
    columns: ClassVar[tuple[str, ...]]
    candidate_columns: ClassVar[tuple[str, ...]] = ()
    horizon: int

    @abstractmethod
    def encode(self, scene: Observation) -> Features:
        """Features of B scenes, from the columns that are not of candidates."""

    @abstractmethod
    def score(self, features: Features, candidates: Observation) -> Tensor:
        """Log-odds of success, float32 (K, T), of K candidates.

        Args:
            features: Of K scenes, candidate by candidate, or of one scene for all of them.
            candidates: The columns of candidates: ``trajectory_image`` has K rows, the others as
                many as there are scenes.
        """

    @property
    def scene_columns(self) -> tuple[str, ...]:
        """The columns that :meth:`encode` reads."""
        return tuple(name for name in self.columns if name not in self.candidate_columns)

    def paired(
        self, features: Features, observation: Observation
    ) -> tuple[Features, dict[str, Tensor]]:
        """Features and columns of candidates, one row for each of n candidates in each of B scenes.

        Args:
            features: Of B scenes.
            observation: The columns of candidates: ``trajectory_image`` has B n rows, scene by
                scene, the others B.
        """
        candidates = {name: observation[name] for name in self.candidate_columns}
        scenes = len(next(iter(features.values())))
        number = len(candidates.get(DRIVEN, ())) // scenes or 1
        if number > 1:
            features = _repeat(features, number)
            shared = {name: candidates[name] for name in candidates if name != DRIVEN}
            candidates |= _repeat(shared, number)
        return features, candidates

    def score_each(self, features: Features, observation: Observation) -> Tensor:
        """Log-odds of success, float32 (B n, T), of n candidates in each of B scenes: `paired`."""
        return self.score(*self.paired(features, observation))

    def logits(self, observation: Observation) -> Tensor:
        """Log-odds of success, float32 (B, T), of a candidate in each of B scenes."""
        return self.score_each(self.encode(observation), observation)

    def forward(self, observation: Observation) -> Tensor:
        """Probabilities of success, (B, T), 1 = success."""
        return torch.sigmoid(self.logits(observation))

    def begin_training(self, batches: int) -> None:
        """Told before the first step how many batches an epoch has; by default of no interest."""

    def loss(self, observation: Observation, success: Tensor, mask: Tensor, weight: Tensor) -> Loss:
        """What training minimises: by default the cross-entropy of the judged steps.

        Args:
            observation: The model's columns of B rows; of ``trajectory_image`` n for each, row by
                row, where labels are for as many.
            success: float32 (B n, T), 1 = success.
            mask: bool (B n, T); steps that are not judged do not count.
            weight: float32 (B n,), of each trajectory.
        """
        logits = self.logits(observation)
        return Loss(masked_cross_entropy(logits, success, mask, weight), logits)


def masked_cross_entropy(logits: Tensor, target: Tensor, mask: Tensor, weight: Tensor) -> Tensor:
    """The weighted mean binary cross-entropy of the judged steps, a scalar.

    Args:
        logits: (B, T), log-odds of what ``target`` is 1 for.
        target: float32 (B, T), 0 or 1.
        mask: bool (B, T); other steps do not count.
        weight: float32 (B,), of each row.
    """
    every = binary_cross_entropy_with_logits(logits.float(), target, reduction="none")
    counted = mask * weight[:, None]
    return (every * counted).sum() / counted.sum().clamp_min(1e-9)


def _repeat(columns: Mapping[str, Tensor], number: int) -> Features:
    """Each row ``number`` times, one after another."""
    return {name: column.repeat_interleave(number, dim=0) for name, column in columns.items()}
