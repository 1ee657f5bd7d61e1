"""What a model was trained with: versions and hardware, nothing that names a machine."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version

import torch
from pydantic import JsonValue

_PACKAGES = ("graspe", "torch", "lightning-fabric", "numpy", "safetensors", "scikit-learn")


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
