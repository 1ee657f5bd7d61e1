from __future__ import annotations

import time
from collections.abc import Iterator

import pytest
import torch

from graspe_data.errors import ZooError
from model_zoo.training.meter import LossMeans, Stopwatch
from model_zoo.training.state import EpochRecord, best_epoch, is_exhausted


def epochs(*areas: float) -> list[EpochRecord]:
    return [
        EpochRecord(epoch=place, step=place, means={"loss": 0.5}, au_roc=area, validation_loss=1)
        for place, area in enumerate(areas)
    ]


def test_the_first_of_equal_epochs_is_the_best_and_patience_counts_from_it() -> None:
    history = epochs(0.5, 0.8, 0.7, 0.8)
    assert best_epoch(history) == 1
    assert is_exhausted(history, 2)
    assert not is_exhausted(history, 3)
    assert not is_exhausted(history, None)
    assert not is_exhausted([], 1)


def test_means_go_on_from_their_sums() -> None:
    whole, first = LossMeans(), LossMeans()
    for number, value in enumerate((0.1, 0.2, 0.7)):
        whole.add({"loss": torch.tensor(value)})
        if number < 2:
            first.add({"loss": torch.tensor(value)})
    second = LossMeans(first.steps, first.sums())
    second.add({"loss": torch.tensor(0.7)})
    assert second.means() == whole.means()
    whole.add({"loss": torch.tensor(float("inf"))})
    with pytest.raises(ZooError, match="loss became inf within this epoch's first 4 steps"):
        whole.sums()


def test_waiting_is_told_from_working() -> None:
    watch = Stopwatch()

    def slow() -> Iterator[None]:
        for _ in range(3):
            time.sleep(0.02)
            yield None

    for _ in watch.waiting(slow()):
        time.sleep(0.02)
    watch.stop()
    seconds = watch.seconds
    assert 0.3 < watch.wait_share < 0.7
    time.sleep(0.01)
    assert watch.seconds == seconds >= 0.12
