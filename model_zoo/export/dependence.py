"""Whether a model looks at what it is given: one that does not keeps parity, and says nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.bundle_contract import BundleContract
from graspe_data.errors import ZooError
from model_zoo.checkpoints import Checkpoint
from model_zoo.export.graphs import CANDIDATES
from model_zoo.export.scenes import SceneRow

LEAST = 1e-5
"""Of the largest log-odds, or of 1: more than rounding makes of the same row, and far less than any
scene makes."""
_CANDIDATES = 7


def check_dependence(
    checkpoint: Checkpoint,
    contract: BundleContract,
    scenes: Sequence[SceneRow],
    candidates: NDArray[np.uint8],
) -> None:
    """Refuse a model whose output is the same whatever it sees.

    Log-odds are compared, since probabilities near 0 and 1 round to the same.

    Args:
        checkpoint: The model.
        contract: Of its bundle.
        scenes: To try, unlike each other.
        candidates: Trajectory images (K, H, W), of which some that differ are tried.

    Raises:
        ZooError: The output is the same in all scenes, or of all candidates though it reads them,
            or whatever one of its inputs is.
    """
    tried = _different(candidates)
    found = np.stack([_log_odds(checkpoint, scene, tried) for scene in scenes])
    _expect_spread(found, 0, f"in {len(scenes)} scenes", contract)
    if contract.uses_candidates and len(tried) > 1:
        _expect_spread(found, 1, f"of {len(tried)} candidates", contract)
    for group in _groups(scenes[0].columns):
        _expect_look(checkpoint, contract, scenes, tried[:1], group)


def _groups(columns: Mapping[str, NDArray[np.generic]]) -> list[tuple[str, ...]]:
    """The columns that are looked at together: points come with their count."""
    together = tuple(name for name in ("points", "point_count") if name in columns)
    groups: list[tuple[str, ...]] = [together] if together else []
    return groups + [(name,) for name in columns if name not in (*together, CANDIDATES)]


def _expect_look(
    checkpoint: Checkpoint,
    contract: BundleContract,
    scenes: Sequence[SceneRow],
    candidate: NDArray[np.uint8],
    group: tuple[str, ...],
) -> None:
    """Give the first scene a group's columns from the others: something must change."""
    first = scenes[0].columns
    swapped = [
        SceneRow(scene.name, scene.kind, {**first, **{name: scene.columns[name] for name in group}})
        for scene in scenes
    ]
    differ = any(
        not np.array_equal(scene.columns[name], first[name], equal_nan=True)
        for scene in scenes
        for name in group
    )
    if differ:
        found = np.stack([_log_odds(checkpoint, scene, candidate) for scene in swapped])
        _expect_spread(found, 0, f"whatever its {' and '.join(group)}", contract)


def _different(candidates: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Some images of which no two are alike: many arcs lie out of the picture."""
    first = {image.tobytes(): place for place, image in reversed(list(enumerate(candidates)))}
    places = sorted(first.values())
    return candidates[places[:: max(1, len(places) // _CANDIDATES)][:_CANDIDATES]]


def _log_odds(checkpoint: Checkpoint, scene: SceneRow, candidates: NDArray[np.uint8]) -> Floats:
    """Of each candidate in a scene, (K, T)."""
    columns = {
        name: torch.from_numpy(np.repeat(column, len(candidates), axis=0))
        for name, column in scene.columns.items()
    }
    columns[CANDIDATES] = torch.from_numpy(np.ascontiguousarray(candidates))
    found: Floats = checkpoint.log_odds(columns).numpy()
    return found


def _expect_spread(found: Floats, axis: int, what: str, contract: BundleContract) -> None:
    if np.ptp(found, axis=axis).max() <= LEAST * max(1.0, np.abs(found).max()):
        raise ZooError(
            f"{contract.model}: its output is the same {what}, {found.flat[0]:.4g} in log-odds, so "
            "it does not look at what it is given. No bundle was written. Train it again: longer, "
            "at a lower learning_rate, or with a larger preset."
        )
