"""Whether a dataset is one that a model can be trained on, before any time is spent."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch

from graspe_data.columns import Column
from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex
from model_zoo.contract import SuccessModel
from model_zoo.labels import LABEL_COLUMNS

TRAIN, VALIDATION = SPLITS = ("train", "validation")
ROWS_TRIED = 2
_PICTURES = {"image": ("uint8",), "trajectory_image": ("uint8", "bool")}


def check_declared(index: DatasetIndex, model: SuccessModel, name: str, where: str) -> None:
    """Compare what the dataset declares with what training the model needs.

    Args:
        index: The content of ``dataset.json``.
        model: What is to be trained.
        name: What the model is called.
        where: The dataset, for the error's text.

    Raises:
        ZooError: A split is missing or empty, a column is missing, the horizon differs, or
            pictures are of another dtype.
    """
    for split in SPLITS:
        if not index.splits.get(split) or not index.rows(split):
            found = ", ".join(f"{key} {index.rows(key)}" for key in index.splits) or "none"
            raise ZooError(
                f"{where}: no rows in the split {split!r}, expected some; rows found: {found}. "
                "Give the dataset's manifest a group of recordings for it and build it again."
            )
    columns = {column.name: column for column in index.columns}
    missing = [column for column in (*model.columns, *LABEL_COLUMNS) if column not in columns]
    if missing:
        raise ZooError(
            f"{where}: {name} needs the column {', '.join(missing)}, which the dataset lacks; it "
            f"has {', '.join(columns)}. Build it with that column, or train another model."
        )
    for label in LABEL_COLUMNS:
        _check_horizon(columns[label], model.horizon, name, where)
    for column, dtypes in _PICTURES.items():
        if column in model.columns and columns[column].dtype not in dtypes:
            raise ZooError(
                f"{where}: column {column} is {columns[column].dtype}, expected "
                f"{' or '.join(dtypes)}. Build the dataset again."
            )


def check_forward(model: SuccessModel, dataset: Dataset, name: str) -> None:
    """Try the model on the dataset's first rows.

    Raises:
        ZooError: It refuses their sizes, or gives something other than finite (B, horizon).
    """
    count = min(ROWS_TRIED, len(dataset))
    arrays = dataset.batch(np.arange(count))
    batch = {name: torch.from_numpy(arrays[name]) for name in model.columns}
    declared = {column.name: column for column in dataset.columns}
    where = f"{dataset.path}: {name} was tried on {count} rows of {_describe(model, declared)}"
    training = model.training
    model.eval()
    try:
        with torch.inference_mode():
            logits = model.logits(batch)
    except (RuntimeError, ValueError, IndexError, KeyError, ZooError) as error:
        raise ZooError(f"{where}, and refused them: {error}. {_SIZES}") from error
    finally:
        model.train(training)
    if logits.shape != (count, model.horizon) or not logits.isfinite().all():
        raise ZooError(
            f"{where}, and gave {tuple(logits.shape)}, expected finite numbers "
            f"({count}, {model.horizon}). {_SIZES}"
        )


_SIZES = "Take a preset for these sizes, set them, or build the dataset with the model's."


def _check_horizon(column: Column, horizon: int, name: str, where: str) -> None:
    if column.shape != (horizon,):
        raise ZooError(
            f"{where}: column {column.name} has rows of {column.shape}, {name} predicts "
            f"({horizon},). Set the model's horizon, or the dataset's horizon.steps."
        )


def _describe(model: SuccessModel, columns: Mapping[str, Column]) -> str:
    return ", ".join(
        f"{name} {columns[name].dtype} {columns[name].shape}" for name in model.columns
    )
