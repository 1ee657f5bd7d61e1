"""``config.json`` of a checkpoint: which model it is, and what it reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field, JsonValue
from torch import Tensor

from graspe_data.bundle_contract import Assumptions
from graspe_data.columns import Column
from graspe_data.documents import Sha256
from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from graspe_data.sealed_folder import SealedFolder
from model_zoo.checkpoints.lineage import Lineage

WEIGHTS_FILE = "model.safetensors"
CHECKPOINT = SealedFolder(
    name="checkpoint",
    format="graspe-checkpoint-1",
    files=frozenset(
        {
            WEIGHTS_FILE,
            "config.json",
            "recipe.yaml",
            "environment.json",
            "metrics.json",
            "calibration.json",
            "card.md",
        }
    ),
    refusal=ZooError,
    remedy="Copy the checkpoint again from where it was made, or train it again.",
)


class InputColumn(Settings):
    """A column that the model reads: dtype and shape of one decoded row."""

    name: str
    dtype: str
    shape: tuple[int, ...]


class Beginning(Settings):
    """The training that another began from.

    Attributes:
        checkpoint: SHA-256 that names what it came to.
        step: Steps it had done.
    """

    checkpoint: Sha256
    step: Annotated[int, Field(ge=1)]


class CheckpointConfig(Settings):
    """What is needed to make the model again.

    Attributes:
        format: Version of the checkpoint's layout.
        model: Its name in the registry.
        preset: The preset that it began from.
        numbers: All its settings, resolved.
        horizon: Steps predicted, T.
        columns: What it reads.
        parameters: Trained and frozen numbers together.
        dataset_digest: Of the dataset it was trained on.
        assumptions: How that dataset's rows were made; None where it did not tell.
        begins_from: The training that this one extends; None where it began with random weights.
        lineage: The recordings and ranks behind the weights; None in checkpoints written before.
    """

    format: Literal["graspe-checkpoint-1"] = "graspe-checkpoint-1"
    model: str
    preset: str
    numbers: Mapping[str, JsonValue]
    horizon: Annotated[int, Field(ge=1)]
    columns: tuple[InputColumn, ...]
    parameters: Annotated[int, Field(ge=0)]
    dataset_digest: Sha256
    assumptions: Assumptions | None = None
    begins_from: Beginning | None = None
    lineage: Lineage | None = None

    def check_columns(self, columns: Sequence[Column], where: str) -> None:
        """Refuse data that the model was not made for.

        Args:
            columns: As a dataset declares them.
            where: The dataset, for the error's text.

        Raises:
            ZooError: A column is missing, or has another dtype or shape.
        """
        found = {column.name: column for column in columns}
        for wanted in self.columns:
            have = found.get(wanted.name)
            if have is None:
                raise ZooError(f"{where}: no column {wanted.name!r}, which {self.model} reads.")
            if (have.dtype, have.shape) != (wanted.dtype, wanted.shape):
                raise ZooError(
                    f"{where}: column {wanted.name}: the checkpoint of {self.model} expects "
                    f"{wanted.dtype} {wanted.shape}, found {have.dtype} {have.shape}. Build the "
                    "dataset with the settings it was trained with, or train anew."
                )


def input_columns(
    names: Sequence[str], columns: Sequence[Column], where: str
) -> tuple[InputColumn, ...]:
    """The declarations of the columns that a model reads.

    Raises:
        ZooError: One is not declared.
    """
    declared = {column.name: column for column in columns}
    missing = [name for name in names if name not in declared]
    if missing:
        raise ZooError(f"{where}: the model reads {', '.join(missing)}, which is not declared.")
    return tuple(
        InputColumn(name=name, dtype=declared[name].dtype, shape=declared[name].shape)
        for name in names
    )


Columns = Mapping[str, Tensor] | Mapping[str, NDArray[Any]]
"""Columns of B rows by name, (B, ...): tensors, or the arrays of a dataset's batch."""


def model_inputs(
    arrays: Columns, columns: Sequence[InputColumn], device: torch.device
) -> dict[str, Tensor]:
    """The columns that a model reads, as tensors on its device.

    Args:
        arrays: Others in it are left out.
        columns: What the model reads.
        device: Where its weights are.

    Raises:
        ZooError: A column is missing, or its rows have another shape.
    """
    missing = [column.name for column in columns if column.name not in arrays]
    if missing:
        found = ", ".join(arrays) or "none"
        raise ZooError(
            f"predict: no column {', '.join(missing)}, found {found}. Give the batch of a dataset "
            "that was opened with the columns `checkpoint.model.columns`."
        )
    return {column.name: _tensor(arrays[column.name], column).to(device) for column in columns}


def _tensor(value: Tensor | NDArray[Any], column: InputColumn) -> Tensor:
    if tuple(value.shape[1:]) != column.shape or not value.shape:
        raise ZooError(
            f"predict: column {column.name}: expected rows of shape {column.shape} in an array "
            f"{('rows', *column.shape)}, found {tuple(value.shape)}. One row too comes as a batch."
        )
    if isinstance(value, Tensor):
        return value
    return torch.from_numpy(np.require(value, requirements=["C", "W"]))
