"""How long one prediction takes and how much memory it needs."""

from __future__ import annotations

import ctypes
import time
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import numpy as np
import torch
from pydantic import Field

from graspe_data.manifest import Settings
from model_zoo.checkpoints import Checkpoint
from model_zoo.contract import Observation

LARGEST_COUNT = 1 << 53
"""Of what a file may claim: up to here every integer is a float, too."""
_STATUS = Path("/proc/self/status")

Number = Annotated[int, Field(ge=0, le=LARGEST_COUNT)]


class Latency(Settings):
    """Of predictions of one row.

    Attributes:
        median_ms: Half of the runs are quicker, milliseconds.
        p90_ms: Nine of ten runs are quicker.
        runs: Predictions timed.
        weight_bytes: Memory of the weights.
        working_bytes: The most that a prediction took beside them; None where the system does not
            tell.
        device: Where it ran.
        threads: That torch might use on a CPU.
    """

    median_ms: Annotated[float, Field(ge=0)]
    p90_ms: Annotated[float, Field(ge=0)]
    runs: Number
    weight_bytes: Number
    working_bytes: Number | None
    device: str
    threads: Number


def measure_latency(checkpoint: Checkpoint, observation: Observation, runs: int = 30) -> Latency:
    """Time predictions of one row, from tensors on the CPU to probabilities on the CPU.

    On a CPU the working memory is what the process grows by while it predicts, after it has given
    back what it does not use.

    Args:
        checkpoint: On the device to measure.
        observation: One row, (1, ...).
        runs: Predictions to time, after three that warm up.
    """
    for _ in range(3):
        checkpoint.predict(observation).cpu()
    working = _working_bytes(checkpoint, observation)
    elapsed = []
    for _ in range(runs):
        begin = time.perf_counter()
        checkpoint.predict(observation).cpu()
        elapsed.append((time.perf_counter() - begin) * 1e3)
    tensors = checkpoint.model.state_dict().values()
    cuda = checkpoint.device.type == "cuda"
    return Latency(
        median_ms=float(np.median(elapsed)),
        p90_ms=float(np.quantile(elapsed, 0.9)),
        runs=runs,
        weight_bytes=sum(tensor.nbytes for tensor in tensors),
        working_bytes=working,
        device=torch.cuda.get_device_name(checkpoint.device) if cuda else "cpu",
        threads=torch.get_num_threads(),
    )


def _working_bytes(checkpoint: Checkpoint, observation: Observation) -> int | None:
    if checkpoint.device.type == "cuda":
        torch.cuda.reset_peak_memory_stats(checkpoint.device)
        before = torch.cuda.memory_allocated(checkpoint.device)
        checkpoint.predict(observation).cpu()
        return torch.cuda.max_memory_allocated(checkpoint.device) - before
    with suppress(OSError, KeyError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # resets VmHWM
        before = _status_bytes("VmRSS")
        checkpoint.predict(observation)
        return max(0, _status_bytes("VmHWM") - before)
    return None


def _status_bytes(key: str) -> int:
    """A value of the process's status, which has it in units of 1024 bytes."""
    lines = (line.partition(":") for line in _STATUS.read_text(encoding="ascii").splitlines())
    values = {name: value for name, _, value in lines}
    return int(values[key].split()[0]) * 1024
