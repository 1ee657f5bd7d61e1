from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from graspe_data.errors import ZooError
from graspe_data.shards import Dataset
from model_zoo.checkpoints import Checkpoint, load_checkpoint
from tests.model_zoo.checkpoints.tiny_model import write_tiny_dataset


@pytest.fixture
def checkpoint(write_tiny: Callable[..., Path]) -> Checkpoint:
    return load_checkpoint(write_tiny())


def test_the_batch_of_a_dataset_is_predicted_as_it_comes(
    checkpoint: Checkpoint, tmp_path: Path
) -> None:
    rows = Dataset(write_tiny_dataset(tmp_path / "data", ("hill",)), "test").batch(range(5))
    tensors = {name: torch.from_numpy(array) for name, array in rows.items()}
    assert torch.equal(checkpoint.predict(rows), checkpoint.predict(tensors))


def test_arrays_that_must_not_be_written_are_taken(checkpoint: Checkpoint) -> None:
    history = np.broadcast_to(np.zeros((4, 2), np.float32), (3, 4, 2))
    rows = {"velocity_history": history, "r_img": np.ones(6, np.float32)[::2]}
    assert checkpoint.predict(rows).shape == (3, 3)


def test_what_does_not_fit_is_named(checkpoint: Checkpoint) -> None:
    row = {"velocity_history": np.zeros((4, 2), np.float32), "r_img": np.ones((), np.float32)}
    with pytest.raises(ZooError, match=r"no column velocity_history, found r_img\. Give"):
        checkpoint.predict({"r_img": row["r_img"]})
    with pytest.raises(ZooError, match=r"velocity_history: expected rows of shape \(4, 2\)"):
        checkpoint.predict(row)
    batch = {name: array[None] for name, array in row.items()}
    with pytest.raises(ZooError, match=r"r_img: expected rows of shape \(\) .* found \(1, 1\)"):
        checkpoint.predict(batch | {"r_img": np.ones((1, 1), np.float32)})
