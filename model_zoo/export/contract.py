"""The contract of a bundle, from its checkpoint."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from graspe_data.bundle_contract import (
    Assumptions,
    BundleContract,
    Decision,
    GraphTensor,
    Thresholds,
    Tolerance,
)
from graspe_data.columns import Column
from graspe_data.errors import ZooError
from graspe_data.observation.catalogue import BY_NAME, columns_of
from graspe_data.observation.settings import ObservationSettings
from model_zoo.checkpoints import Checkpoint
from model_zoo.checkpoints.config import InputColumn
from model_zoo.export.graphs import CANDIDATES, OPSET, OUTPUT

DECAY = 0.95
"""Of the weights of PAAD's steps."""


def bundle_contract(
    checkpoint: Checkpoint,
    assumptions: Assumptions,
    features: Mapping[str, tuple[int, ...]],
    tolerance: Tolerance,
    thresholds: Thresholds,
) -> BundleContract:
    """State what the graphs of a checkpoint take and give.

    Args:
        checkpoint: Whose graphs they are.
        assumptions: How the rows were made that it was trained on.
        features: Shapes of what goes from one graph to the other, in their order.
        tolerance: Of parity.
        thresholds: Of the planner.

    Raises:
        ZooError: As :func:`planner_inputs`.
    """
    config, model = checkpoint.config, checkpoint.model
    inputs = planner_inputs(checkpoint, assumptions.observation)
    several = CANDIDATES in model.candidate_columns
    return BundleContract(
        model=config.model,
        preset=config.preset,
        horizon=config.horizon,
        step_s=assumptions.observation.horizon_step_s,
        encode_inputs=tuple(inputs[name] for name in model.scene_columns),
        features=_features(features),
        score_inputs=tuple(inputs[name] for name in model.candidate_columns),
        output=_output("K" if several else 1, config.horizon),
        uses_candidates=several,
        temperature=temperature(checkpoint),
        decision=Decision(
            **dict(thresholds), step_weights=tuple(decision_weights(config.horizon).tolist())
        ),
        observation=assumptions.observation,
        robot=assumptions.robot,
        dataset_digest=config.dataset_digest,
        checkpoint_digest=checkpoint.digest,
        parity=tolerance,
        opset=OPSET,
    )


def _features(shapes: Mapping[str, tuple[int, ...]]) -> tuple[GraphTensor, ...]:
    """What goes from one graph to the other."""
    meaning = "of encode, unchanged to score"
    return tuple(
        GraphTensor(name=name, dtype="float32", shape=shape, meaning=meaning)
        for name, shape in shapes.items()
    )


def _output(candidates: int | Literal["K"], horizon: int) -> GraphTensor:
    return GraphTensor(
        name=OUTPUT,
        dtype="float32",
        shape=(candidates, horizon),
        unit="1",
        meaning="calibrated probability of success at each step, 1 = success",
    )


def planner_inputs(
    checkpoint: Checkpoint, observation: ObservationSettings
) -> dict[str, GraphTensor]:
    """The columns that a model reads, as a planner must derive them.

    Raises:
        ZooError: The checkpoint's columns are not those of its dataset's settings.
    """
    inputs, config = _inputs(observation), checkpoint.config
    for column in config.columns:
        _check(column, inputs, checkpoint)
    if config.horizon != observation.horizon_steps:
        raise ZooError(
            f"{checkpoint.folder / 'config.json'}: the model predicts {config.horizon} steps, its "
            f"dataset's settings say {observation.horizon_steps}. Train it again."
        )
    return {column.name: inputs[column.name] for column in config.columns}


def temperature(checkpoint: Checkpoint) -> float:
    """What logits are divided by, 1 where the checkpoint is not calibrated."""
    calibration = checkpoint.calibration
    return 1.0 if calibration is None else calibration.temperature


def decision_weights(horizon: int, decay: float = DECAY) -> NDArray[np.float64]:
    """Weights of the steps, (T,), proportional to decay^i: nearer steps count more; they sum to 1.

    Source: tianchenji/PAAD, rosnode/ad_paad.py.
    """
    weights = decay ** np.arange(horizon, dtype=np.float64)
    return np.asarray(weights / weights.sum())


def _inputs(observation: ObservationSettings) -> dict[str, GraphTensor]:
    """Every column that a model may read, as a planner must derive it."""
    frames = {"base": "base_link", "camera": "camera"}
    columns = {column.name: column for column in columns_of(observation.sizes, frames)}
    return {name: _tensor(column) for name, column in columns.items() if BY_NAME[name].live}


def _tensor(column: Column) -> GraphTensor:
    """A column of one scene, or of each of K candidates."""
    leading: tuple[int | Literal["K"], ...] = ("K",) if column.name == CANDIDATES else (1,)
    return GraphTensor(
        name=column.name,
        dtype=column.dtype,
        shape=(*leading, *column.shape),
        unit=column.unit,
        frame=column.frame,
        meaning=column.meaning,
    )


def _check(column: InputColumn, inputs: Mapping[str, GraphTensor], checkpoint: Checkpoint) -> None:
    where = f"{checkpoint.folder / 'config.json'}: column {column.name}"
    tensor = inputs.get(column.name)
    if tensor is None:
        raise ZooError(f"{where}: a planner has no such column; it has {', '.join(inputs)}.")
    if (column.dtype, column.shape) != (tensor.dtype, tensor.shape[1:]):
        raise ZooError(
            f"{where}: the model reads {column.dtype} {column.shape}, by its dataset's settings "
            f"an observation has {tensor.dtype} {tensor.shape[1:]}. Train it again on a dataset "
            "of this version."
        )
