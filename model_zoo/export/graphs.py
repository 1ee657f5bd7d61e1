"""A model as two ONNX graphs: the scene's, and the candidates' within it."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import torch
from onnx import ModelProto
from torch import Tensor, nn

from graspe_data.errors import ZooError
from model_zoo.contract import Features, Observation, SuccessModel
from model_zoo.export.portable_graph import loop_over_candidates, portable_graph

OPSET = 20
OUTPUT = "success"
CANDIDATES = "trajectory_image"
_TRIED_CANDIDATES = 3


@dataclass(frozen=True)
class Graphs:
    """What :func:`export_graphs` makes.

    Attributes:
        encode: The scene's graph, serialised.
        score: The candidates' graph, serialised.
        features: Shape of each feature that goes from one to the other, in its order.
    """

    encode: bytes
    score: bytes
    features: Mapping[str, tuple[int, ...]]


def export_graphs(model: SuccessModel, temperature: float, example: Observation) -> Graphs:
    """Export a model by ``torch.export``; the number of candidates stays open.

    Args:
        model: In evaluation mode, on the CPU.
        temperature: By which its logits are divided.
        example: One scene with one candidate, every column (1, ...).

    Raises:
        ZooError: torch cannot export the model.
    """
    scene = tuple(example[name] for name in model.scene_columns)
    with torch.no_grad():
        features = model.encode(example)
        several = {name: example[name] for name in model.candidate_columns}
        if CANDIDATES in several:
            several[CANDIDATES] = several[CANDIDATES].expand(_TRIED_CANDIDATES, -1, -1)
        encode = _export(_Encode(model), scene, model.scene_columns, tuple(features))
        score = _export(
            _Score(model, tuple(features), temperature),
            (*features.values(), *(column.contiguous() for column in several.values())),
            (*features, *several),
            (OUTPUT,),
        )
    if CANDIDATES in several:
        score = loop_over_candidates(score, CANDIDATES)
    shapes = {name: tuple(feature.shape) for name, feature in features.items()}
    return Graphs(encode.SerializeToString(), score.SerializeToString(), shapes)


class _Encode(nn.Module):
    """Columns of a scene to its features, both in order."""

    def __init__(self, model: SuccessModel) -> None:
        super().__init__()
        self.model = model

    def forward(self, *columns: Tensor) -> tuple[Tensor, ...]:
        scene = dict(zip(self.model.scene_columns, columns, strict=True))
        return tuple(self.model.encode(scene).values())


class _Score(nn.Module):
    """Features and columns of candidates, in order, to calibrated probabilities."""

    def __init__(self, model: SuccessModel, features: tuple[str, ...], temperature: float) -> None:
        super().__init__()
        self.model, self.features, self.temperature = model, features, temperature

    def forward(self, *inputs: Tensor) -> Tensor:
        count = len(self.features)
        features: Features = dict(zip(self.features, inputs[:count], strict=True))
        candidates = dict(zip(self.model.candidate_columns, inputs[count:], strict=True))
        return torch.sigmoid(self.model.score(features, candidates) / self.temperature)


@contextmanager
def _quiet_torch() -> Iterator[None]:
    """Without torch's words on changes to come within itself, and on torchvision's absence."""
    logger = logging.getLogger("torch.onnx")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings(action="ignore"):
            yield
    finally:
        logger.setLevel(level)


def _export(
    module: nn.Module, inputs: tuple[Tensor, ...], names: tuple[str, ...], outputs: tuple[str, ...]
) -> ModelProto:
    many = torch.export.Dim("K", min=1)
    open_axes = tuple({0: many} if name == CANDIDATES else None for name in names)
    try:
        with _quiet_torch():
            traced = torch.export.export(module.eval(), inputs, dynamic_shapes=(open_axes,))
            program = torch.onnx.export(
                traced,
                inputs,
                dynamo=True,
                verbose=False,
                opset_version=OPSET,
                input_names=list(names),
                output_names=list(outputs),
            )
    except (RuntimeError, ValueError, torch.onnx.OnnxExporterError) as error:
        reason = str(error).partition("\n")[0]
        raise ZooError(f"{', '.join(outputs)}: torch cannot export the graph: {reason}") from error
    if program is None:
        raise ZooError(f"{', '.join(outputs)}: torch exported no graph.")
    return portable_graph(program.model_proto, open_names={CANDIDATES, OUTPUT})
