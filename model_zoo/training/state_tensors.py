"""The tensors of a training's state by name, and the digest that tells damage."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import torch
from torch import Tensor

Weights = dict[str, Tensor]


def state_digest(counts: str, tensors: Mapping[str, Tensor]) -> str:
    """SHA-256 of the counts and of each tensor's name, dtype, shape and bytes."""
    digest = hashlib.sha256(counts.encode())
    for name, tensor in sorted(tensors.items()):
        digest.update(f"\0{name}\0{tensor.dtype}\0{tuple(tensor.shape)}\0".encode())
        digest.update(tensor.contiguous().reshape(-1).view(torch.uint8).numpy().data)
    return digest.hexdigest()


def prefixed(prefix: str, tensors: Mapping[str, Tensor]) -> Weights:
    """Separate contiguous copies on the CPU: safetensors stores no views."""
    return {
        f"{prefix}.{name}": tensor.detach().cpu().clone().contiguous()
        for name, tensor in tensors.items()
    }


def below(prefix: str, tensors: Mapping[str, Tensor]) -> Weights:
    """The tensors under a prefix, without it."""
    head = f"{prefix}."
    return {name.removeprefix(head): t for name, t in tensors.items() if name.startswith(head)}


def optimiser_tensors(optimiser: torch.optim.Optimizer) -> Weights:
    """What an optimiser remembers of each weight."""
    slots = optimiser.state_dict()["state"]
    flat = {f"{place}.{name}": t for place, slot in slots.items() for name, t in slot.items()}
    return prefixed("optimiser", flat)


def fill_optimiser(optimiser: torch.optim.Optimizer, tensors: Weights) -> None:
    """Give an optimiser back what :func:`optimiser_tensors` took."""
    slots: dict[int, Weights] = {}
    for key, tensor in tensors.items():
        place, name = key.split(".", 1)
        slots.setdefault(int(place), {})[name] = tensor
    optimiser.load_state_dict(optimiser.state_dict() | {"state": slots})
