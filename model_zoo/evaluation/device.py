"""Which device an evaluation computes on."""

from __future__ import annotations

from typing import Literal

import torch

from graspe_data.errors import ZooError

Device = Literal["auto", "cpu", "cuda"]


def choose_device(asked: Device) -> torch.device:
    """The device asked for; ``auto`` takes a GPU where there is one.

    Raises:
        ZooError: A GPU is asked for and there is none.
    """
    found = torch.cuda.is_available()
    if asked == "cuda" and not found:
        raise ZooError("device: cuda was asked for and torch finds none. Take auto or cpu.")
    return torch.device("cuda" if found and asked != "cpu" else "cpu")
