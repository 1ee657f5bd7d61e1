"""Weights of a checkpoint, compared with the model before memory is taken for either."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import load_file

from graspe_data.errors import ZooError
from model_zoo.contract import SuccessModel
from model_zoo.planned_model import plan_model

LARGEST_NUMBER = 1 << 20


def check_sizes(numbers: Any, where: Path) -> None:
    """Refuse what no model is as large as, before anything of that size is made.

    Args:
        numbers: Settings as JSON has them.
        where: Their file, for the error's text.

    Raises:
        ZooError: A whole number among them is too large.
    """
    if isinstance(numbers, Mapping):
        numbers = list(numbers.values())
    if isinstance(numbers, Sequence) and not isinstance(numbers, str):
        for inner in numbers:
            check_sizes(inner, where)
    elif isinstance(numbers, int) and abs(numbers) > LARGEST_NUMBER:
        raise ZooError(f"{where}: a number is {numbers}, expected at most {LARGEST_NUMBER}.")


_DTYPES = {
    torch.float64: "F64",
    torch.float32: "F32",
    torch.float16: "F16",
    torch.bfloat16: "BF16",
    torch.int64: "I64",
    torch.int32: "I32",
    torch.int16: "I16",
    torch.int8: "I8",
    torch.uint8: "U8",
    torch.bool: "BOOL",
}

_Layout = dict[str, tuple[str, tuple[int, ...]]]


def load_weights(
    file: Path, make: Callable[[], SuccessModel], parameters: int | None = None
) -> SuccessModel:
    """Make a model and fill it from a safetensors file.

    The model is first made without memory for its weights, whatever sizes its settings ask for.

    Args:
        file: The weights.
        make: Makes the model.
        parameters: How many it is said to have; None is not compared.

    Raises:
        ZooError: The file is damaged, the model has another number of parameters, or a weight is
            missing, unknown, or of another shape or dtype.
    """
    stored = _stored_layout(file)
    planned = plan_model(make, str(file.parent / "config.json"))
    _compare(file, _layout(planned), stored)
    found = sum(parameter.numel() for parameter in planned.parameters())
    if parameters not in (None, found):
        raise ZooError(
            f"{file}: the model has {found} parameters, config.json says {parameters}. {_OTHER}"
        )
    model = make()
    model.load_state_dict(load_file(file))
    return model


def _stored_layout(file: Path) -> _Layout:
    try:
        with safe_open(file, framework="pt") as opened:
            slices = {name: opened.get_slice(name) for name in opened.keys()}  # noqa: SIM118
            return {
                name: (part.get_dtype(), tuple(part.get_shape())) for name, part in slices.items()
            }
    except (SafetensorError, OSError) as error:
        raise ZooError(f"{file}: not a file of weights: {error}.") from error


def _layout(model: SuccessModel) -> _Layout:
    return {
        name: (_DTYPES[tensor.dtype], tuple(tensor.shape))
        for name, tensor in model.state_dict().items()
    }


def _compare(file: Path, expected: _Layout, stored: _Layout) -> None:
    for names, what in (
        (expected.keys() - stored.keys(), "the model has weights that the file lacks"),
        (stored.keys() - expected.keys(), "the file has weights that the model lacks"),
    ):
        if names:
            shown = ", ".join(sorted(names)[:5])
            raise ZooError(f"{file}: {what}: {shown} ({len(names)} in all). {_OTHER}")
    for name, wanted in expected.items():
        if stored[name] != wanted:
            raise ZooError(
                f"{file}: {name}: expected {_show(wanted)}, found {_show(stored[name])}. {_OTHER}"
            )


def _show(layout: tuple[str, tuple[int, ...]]) -> str:
    return f"{layout[0]} {layout[1]}"


_OTHER = "It belongs to another model or other settings than config.json says."
