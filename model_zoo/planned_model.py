"""A model as it would be, before memory is taken for its weights."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from typing import Any

import torch
from torch.overrides import TorchFunctionMode

from graspe_data.errors import ZooError
from model_zoo.contract import SuccessModel

MOST_PARAMETERS = 1_000_000_000
"""4 GB of weights, and four times as much with Adam: a hundred times the largest preset."""


def plan_model(make: Callable[[], SuccessModel], where: str) -> SuccessModel:
    """Make a model whose weights take no memory, whatever sizes its settings ask for.

    Nothing is drawn from torch's generator.

    Args:
        make: Makes the model.
        where: Its settings, for the error's text.

    Raises:
        ZooError: The settings make no model, one with a layer that has no weights, or one that is
            too large.
    """
    try:
        with torch.random.fork_rng(devices=[]), _WithoutMemory(), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of layers without weights, which are told below
            model = make()
    except (RuntimeError, ValueError, OverflowError, MemoryError) as error:
        reason = (str(error).splitlines() or ["no memory"])[0]
        raise ZooError(f"{where}: these numbers make no model: {reason}.") from error
    for name, weight in model.named_parameters():
        if not weight.numel():
            raise ZooError(
                f"{where}: these numbers make no model: {name} is {tuple(weight.shape)}, so "
                "nothing passes it. Take a larger picture, or shrink it less."
            )
    count = sum(weight.numel() for weight in model.parameters())
    if count > MOST_PARAMETERS:
        raise ZooError(
            f"{where}: {count:,} parameters, expected at most {MOST_PARAMETERS:,}. Set its sizes "
            "lower."
        )
    return model


class _WithoutMemory(TorchFunctionMode):
    """Puts tensors that are made to be filled, as weights are, on the ``meta`` device.

    Tensors that are computed, as tables kept in buffers are, stay real: not all of torch works on
    that device.
    """

    def __torch_function__(
        self,
        func: Callable[..., Any],
        types: Iterable[type],
        args: tuple[Any, ...] = (),
        kwargs: dict[str, Any] | None = None,
    ) -> Any:
        """Call a function of torch."""
        device = {"device": "meta"} if func is torch.empty else {}
        return func(*args, **{**(kwargs or {}), **device})
