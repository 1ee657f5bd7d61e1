"""What a checkpoint is asked about, as its model takes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from graspe_data.errors import ZooError
from model_zoo.checkpoints.config import InputColumn

Columns = Mapping[str, Tensor] | Mapping[str, NDArray[Any]]
"""Columns of B rows by name, (B, ...): tensors, or the arrays of a dataset's batch."""


def model_inputs(
    given: Columns, columns: Sequence[InputColumn], device: torch.device
) -> dict[str, Tensor]:
    """The columns that a model reads, as tensors on its device.

    Args:
        given: Others in it are left out.
        columns: What the model reads.
        device: Where its weights are.

    Raises:
        ZooError: A column is missing, or its rows have another shape.
    """
    missing = [column.name for column in columns if column.name not in given]
    if missing:
        found = ", ".join(given) or "none"
        raise ZooError(
            f"predict: no column {', '.join(missing)}, found {found}. Give the batch of a dataset "
            "that was opened with the columns `checkpoint.model.columns`."
        )
    return {column.name: _tensor(given[column.name], column).to(device) for column in columns}


def _tensor(value: Tensor | NDArray[Any], column: InputColumn) -> Tensor:
    if tuple(value.shape[1:]) != column.shape or not value.shape:
        raise ZooError(
            f"predict: column {column.name}: expected rows of shape {column.shape} in an array "
            f"{('rows', *column.shape)}, found {tuple(value.shape)}. One row too comes as a batch."
        )
    if isinstance(value, Tensor):
        return value
    return torch.from_numpy(np.require(value, requirements=["C", "W"]))
