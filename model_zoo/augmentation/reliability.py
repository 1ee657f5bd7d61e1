"""Which reliabilities a model is given: those measured, or those of a control."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, get_args

import numpy as np
import torch
from torch import Tensor

from graspe_data.errors import ZooError
from model_zoo.augmentation.failing_rows import OF_IMAGE, OF_POINTS, RowFailure
from model_zoo.augmentation.settings import ReliabilitySource

SOURCES: tuple[ReliabilitySource, ...] = get_args(ReliabilitySource)


def give_reliabilities(
    batch: dict[str, Tensor],
    source: ReliabilitySource,
    failures: Sequence[RowFailure],
    key: Sequence[int],
) -> dict[str, Tensor]:
    """A batch with the reliabilities of a source; the same batch where they are those measured.

    Args:
        batch: Columns of B rows, their reliabilities measured; not changed.
        source: Of the reliabilities.
        failures: What happened to each of the B rows.
        key: Words, 0 or more, that seed what is drawn.
    """
    if source == "measured":
        return batch
    if source == "shuffled":
        other = torch.from_numpy(np.random.default_rng(key).permutation(len(failures)))
        return batch | {name: batch[name][other] for name in _present(batch, OF_IMAGE + OF_POINTS)}
    cameras = torch.tensor([failure.picture.nothing for failure in failures])
    lidars = torch.tensor([failure.lidar.nothing for failure in failures])
    return (
        batch
        | {name: cameras.to(batch[name].dtype) for name in _present(batch, OF_IMAGE)}
        | {name: lidars.to(batch[name].dtype) for name in _present(batch, OF_POINTS)}
    )


def taught_with(recipe: Mapping[str, Any]) -> ReliabilitySource:
    """The reliabilities that a checkpoint's recipe gave its model.

    Raises:
        ZooError: The recipe names none that is known.
    """
    augmentation = recipe.get("augmentation")
    name = augmentation.get("reliability") if isinstance(augmentation, Mapping) else None
    for known in SOURCES:
        if name in (None, known):
            return known
    raise ZooError(f"recipe: reliability is {name!r}, expected one of {', '.join(SOURCES)}.")


def _present(batch: dict[str, Tensor], names: Iterable[str]) -> list[str]:
    return [name for name in names if name in batch]
