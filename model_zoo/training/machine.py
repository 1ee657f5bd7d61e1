"""What a training runs on: devices, readers, how often it saves; none of it is the recipe's."""

from __future__ import annotations

import atexit
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import torch
from lightning_fabric import Fabric
from lightning_fabric.loggers.tensorboard import TensorBoardLogger
from pydantic import Field

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.bounds import NO_TRUTH
from model_zoo.environment import Device, choose_device
from model_zoo.training.progress import TrainingProgress
from model_zoo.training.recipe import Recipe

LOG_FOLDER = "log"
MOST_THREADS = 1024


class Machine(Settings):
    """How a training uses the machine.

    Attributes:
        device: ``auto`` takes a GPU where there is one. Under ``torchrun`` every rank takes its
            own.
        workers: Processes of each rank that read and augment ahead; 0 reads between steps.
        threads: Of torch, for each rank; None leaves torch's own choice.
        state_every_s: Seconds after which the state is saved again.
        state_every_steps: Steps after which it is saved as well; None goes by the time alone.
        tensorboard: Whether losses, rates and scores are logged for TensorBoard.
    """

    device: Device = "auto"
    workers: Annotated[int, Field(strict=True, ge=0, le=1024)] = 1
    threads: Annotated[int, Field(strict=True, gt=0, le=10**18)] | None = None
    state_every_s: Annotated[float, Field(gt=0, le=1e9), NO_TRUTH] = 60.0
    state_every_steps: Annotated[int, Field(strict=True, gt=0, le=10**12)] | None = None
    tensorboard: bool = True


@dataclass(frozen=True)
class Session:
    """What a training runs on, and who hears of it.

    Attributes:
        fabric: The ranks.
        machine: How they use it.
        progress: Hears how the training goes.
    """

    fabric: Fabric
    machine: Machine
    progress: TrainingProgress


def count_ranks() -> int:
    """Processes that share a step: 1, or what ``torchrun`` says."""
    return int(os.environ.get("WORLD_SIZE", "1"))


def launch_fabric(machine: Machine, recipe: Recipe, out: Path) -> Fabric:
    """Join the other ranks, if ``torchrun`` started this one among some.

    Args:
        machine: The devices.
        recipe: Its precision.
        out: The run's folder; logs go to a folder in it.

    Raises:
        ZooError: A GPU is asked for and there is none, more threads than make sense are, or logs
            cannot be written.
    """
    _check_threads(machine.threads)
    _check_log(machine, out / LOG_FOLDER)
    device = choose_device(machine.device)
    if machine.threads is not None:
        torch.set_num_threads(machine.threads)
    ranks, local = count_ranks(), int(os.environ.get("LOCAL_WORLD_SIZE", "1"))
    fabric = Fabric(
        accelerator=device.type,
        devices=local,
        num_nodes=ranks // local,
        strategy="ddp" if ranks > 1 else "auto",
        precision="bf16-mixed" if recipe.precision == "bf16" else "32-true",
        loggers=[TensorBoardLogger(out, LOG_FOLDER, "")] if machine.tensorboard else [],
    )
    fabric.launch()
    if ranks > 1:
        atexit.register(_leave_ranks)
    return fabric


def _leave_ranks() -> None:
    """Leave the process group before the process ends.

    Its threads would else be torn down with the interpreter, which aborts now and then: a training
    that was done would look as if it had failed.
    """
    if torch.distributed.is_initialized():
        torch.distributed.destroy_process_group()


def _check_threads(threads: int | None) -> None:
    if threads is not None and threads > MOST_THREADS:
        raise ZooError(f"threads: {threads} asked for, expected at most {MOST_THREADS}.")


def _check_log(machine: Machine, folder: Path) -> None:
    if machine.tensorboard and os.path.lexists(folder) and not folder.is_dir():
        raise ZooError(
            f"{folder}: found a file, expected the folder of the run's logs or nothing. Move it "
            "away, or give another folder for the run."
        )
