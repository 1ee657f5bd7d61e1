"""Whether all runs of a zoo can be trained and evaluated, before the first step of the first."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import DatasetIndex, read_index
from model_zoo.augmentation import Condition
from model_zoo.evaluation.blind_rows import blind_columns
from model_zoo.labels import LABEL_COLUMNS
from model_zoo.registry import create_model
from model_zoo.split_leaks import check_apart
from model_zoo.training.checks import VALIDATION, check_declared, check_forward

Named = tuple[str, str]


def check_data(dataset: Path, split: str, models: Sequence[Named]) -> None:
    """Try every model on a dataset.

    Args:
        dataset: Its folder.
        split: What is evaluated.
        models: Names and presets.

    Raises:
        ZooError: A model, the splits for training, or the one for evaluation do not fit, what is
            evaluated is not apart from what teaches, or there is nothing for blind references.
        ShardError: It is no dataset, or the split has no labels.
    """
    index = read_index(dataset)
    _check_split(index, split, dataset)
    check_apart(index.recordings, index.recordings, split, dataset)
    blind_columns(index, dataset)
    Dataset(dataset, split, LABEL_COLUMNS)
    for name, preset in dict.fromkeys(models):
        model = create_model(name, preset)
        check_declared(index, model, name, str(dataset))
        check_forward(model, Dataset(dataset, VALIDATION, model.columns), name)


def check_distinct(runs: Sequence[str], conditions: Sequence[Condition]) -> None:
    """Refuse what is asked for twice.

    Raises:
        ZooError: Names it.
    """
    for what, names in (("run", runs), ("condition", conditions)):
        if not names:
            raise ZooError(f"zoo: no {what} was asked for, expected at least one.")
        twice = [name for place, name in enumerate(names) if name in names[:place]]
        if twice:
            raise ZooError(
                f"zoo: the {what} {twice[0]} is asked for twice, expected once. Leave one out."
            )


def check_folders(out: Path, inner: Sequence[str]) -> None:
    """Make the folder of all runs, and see that it can be written.

    Args:
        out: The folder.
        inner: Names of folders that will be made in it.

    Raises:
        ZooError: It cannot, or a file lies where one of those will be.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ZooError(f"{out}: cannot be made: {error.strerror}. Give another folder.") from error
    if not os.access(out, os.W_OK | os.X_OK):
        raise ZooError(f"{out}: cannot be written. Give another folder, or change its rights.")
    for folder in (out / name for name in inner):
        if os.path.lexists(folder) and not folder.is_dir():
            raise ZooError(f"{folder}: found a file, expected a folder or nothing. Move it away.")


def _check_split(index: DatasetIndex, split: str, dataset: Path) -> None:
    if not index.splits.get(split) or not index.rows(split):
        found = ", ".join(f"{name} {index.rows(name)}" for name in index.splits) or "none"
        raise ZooError(
            f"{dataset}: no rows in the split {split!r}, which is to be evaluated; rows found: "
            f"{found}. Take another split."
        )
