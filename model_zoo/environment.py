"""What models run on: the device, and the versions and hardware that a checkpoint tells of."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Literal

import torch
from pydantic import JsonValue

from graspe_data.errors import ZooError

Device = Literal["auto", "cpu", "cuda"]

_PACKAGES = ("graspe", "torch", "lightning-fabric", "numpy", "safetensors", "scikit-learn")


def choose_device(device: Device) -> torch.device:
    """The device asked for; ``auto`` takes a GPU where there is one.

    Raises:
        ZooError: A GPU is asked for and there is none.
    """
    found = torch.cuda.is_available()
    if device == "cuda" and not found:
        raise ZooError("device: cuda was asked for and torch finds none. Take auto or cpu.")
    return torch.device("cuda" if found and device != "cpu" else "cpu")


def describe_environment() -> dict[str, JsonValue]:
    """Versions of Python and of the packages that decide the numbers, and the device."""
    gpu = torch.cuda.get_device_name() if torch.cuda.is_available() else None
    return {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "packages": {name: _version(name) for name in _PACKAGES},
        "gpu": gpu,
        "threads": torch.get_num_threads(),
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
