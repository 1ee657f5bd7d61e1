"""One model on all ranks: what layers count while they train is taken from rank 0."""

from __future__ import annotations

import torch
from lightning_fabric import Fabric
from torch import nn


def share_buffers(fabric: Fabric, model: nn.Module) -> None:
    """Give every rank the buffers of rank 0, such as the running means of batch normalisation.

    Gradients are averaged, so weights are the same everywhere; buffers are not: each rank counts
    its own rows. Of rank 0, and no average, for two reasons. DistributedDataParallel hands out rank
    0's buffers before each step in training, so an average would be of its last step alone. And
    rank 0 saves the state, so that a training which goes on from it has what this one had.

    Args:
        fabric: The ranks.
        model: Not wrapped, on the rank's device.
    """
    if fabric.world_size == 1:
        return
    for buffer in model.buffers():
        torch.distributed.broadcast(buffer, src=0)
