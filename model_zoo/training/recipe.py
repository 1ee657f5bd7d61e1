"""What decides how a model is trained; ``manifests/recipes`` has those that ship."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, find_manifest, load_manifest
from model_zoo.augmentation.settings import AugmentationSettings

Balance = Literal["none", "rows", "resample"]
Count = Annotated[int, Field(gt=0, le=10**9)]


class Recipe(Settings):
    """Everything that decides the weights, beside the model, the dataset and the ranks.

    The defaults are PAAD's and GrASPE's: Adam, 5e-4, 1.5e-4, batches of 16, 50 epochs.

    Attributes:
        epochs: Passes over the training rows.
        most_steps: Stop after so many steps even where epochs are left, so that models whose
            epochs differ in length can have the same budget; None leaves it to the epochs.
        batch_size: Rows of a step and a rank.
        learning_rate: Of Adam, at its highest.
        weight_decay: Of Adam, as L2 penalty.
        gradient_clip: Longest gradient; None does not clip.
        schedule: ``constant``, or ``cosine`` down to zero at the last step.
        warm_up_steps: Steps over which the learning rate rises from zero.
        balance: Rows that fail against rows that do not: ``rows`` weighs both alike in the loss,
            ``resample`` takes PAAD's choice of rows, ``none`` leaves them as they are.
        candidates: Trajectories of each row beside the driven one, drawn at each step from those
            whose outcome a simulated dataset knows; models without a trajectory take none.
        ranking: Weight of telling the trajectories of a row apart, beside a cross-entropy of weight
            1; see ``ranking_loss``. Ours. It needs candidates.
        augmentation: How often which rows are mirrored and which sensors fail; ``{}`` takes its
            defaults, None leaves rows as they are.
        patience: Epochs without a better validation AU-ROC after which training stops; None
            never stops early. The best epoch's weights are kept in any case.
        precision: ``bf16`` computes in mixed precision.
        seed: Of the weights, the order and all that is random.
        searched: Trainings whose validation scores chose these settings and the model's, this
            kind among them. It decides nothing and stands in the tables, since a model that was
            searched for longer looks better; None where it is not said.
    """

    epochs: Count = 50
    most_steps: Count | None = None
    batch_size: Count = 16
    learning_rate: Annotated[float, Field(gt=0, le=10)] = 5e-4
    weight_decay: Annotated[float, Field(ge=0, le=1)] = 1.5e-4
    gradient_clip: Annotated[float, Field(gt=0, le=1e6)] | None = 5.0
    schedule: Literal["constant", "cosine"] = "constant"
    warm_up_steps: Annotated[int, Field(ge=0, le=10**9)] = 0
    balance: Balance = "rows"
    candidates: Annotated[int, Field(ge=0, le=64)] = 0
    ranking: Annotated[float, Field(ge=0, le=1000)] = 0.0
    augmentation: AugmentationSettings | None = None
    patience: Count | None = 10
    precision: Literal["float32", "bf16"] = "float32"
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    searched: Count | None = None

    @model_validator(mode="after")
    def _something_to_rank(self) -> Self:
        if self.ranking and not self.candidates:
            raise ValueError("ranking needs trajectories to compare: set candidates, or ranking: 0")
        return self

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth(cls, value: object) -> object:
        for where, truth in _truths(value):
            raise ValueError(f"{where}expected a number or a name, found {str(truth).lower()}")
        return value


def _truths(value: object, key: str = "") -> Iterator[tuple[str, bool]]:
    """Every ``true`` and ``false`` in a value as it was given, and where it stands."""
    if isinstance(value, bool):
        yield f"{key}: " if key else "", value
    pairs = enumerate(value) if isinstance(value, list | tuple) else ()
    for inner, content in value.items() if isinstance(value, Mapping) else pairs:
        yield from _truths(content, f"{key}.{inner}" if key else str(inner))


def load_recipe(name: str | Path) -> Recipe:
    """A recipe by path, or by the name of one that ships.

    Raises:
        ZooError: There is none, or it does not validate.
    """
    try:
        return load_manifest(find_manifest("recipes", name), Recipe)
    except ManifestError as error:
        raise ZooError(str(error)) from error
