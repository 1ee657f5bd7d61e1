from __future__ import annotations

import io
import time
from collections.abc import Iterator

import pytest
import torch
from rich.console import Console

from graspe_data.errors import ZooError
from model_zoo.training.console_progress import ConsoleTrainingProgress
from model_zoo.training.history import EpochRecord, best_epoch, is_exhausted
from model_zoo.training.meter import LossMeans, Stopwatch
from model_zoo.training.progress import StepReport


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


def test_in_a_pipe_it_prints_plain_lines() -> None:
    text = io.StringIO()
    with ConsoleTrainingProgress(Console(file=text, width=40), line_every_s=0.0) as progress:
        progress.start("graspe small", 20, 10)
        progress.step(StepReport(12, 20, 1, 0.25, 31.4, 0.012, 75.0))
        progress.epoch(epochs(0.75)[0], best=True)
        progress.finish("all steps done")
    lines = text.getvalue().splitlines()
    assert lines[0] == "graspe small: goes on at step 10"
    assert lines[1] == (
        "[step 12/20] epoch 1  loss 0.2500  31.4 samples/s  waiting for data 1.2%  1:15 left"
    )
    assert "validation AU-ROC 0.7500 (best)" in lines[2]
    assert lines[3] == "all steps done"


def test_lines_of_steps_are_few_in_a_pipe() -> None:
    text = io.StringIO()
    with ConsoleTrainingProgress(Console(file=text)) as progress:
        progress.start("graspe small", 20, 0)
        progress.step(StepReport(12, 20, 1, 0.25, 31.4, 0.012, 7500.0))
    assert text.getvalue() == "graspe small: begins\n"


def test_what_is_done_beside_the_steps_is_told_in_a_pipe_and_on_a_terminal() -> None:
    pipe, terminal = io.StringIO(), io.StringIO()
    for console in (Console(file=pipe), Console(file=terminal, force_terminal=True, width=160)):
        with ConsoleTrainingProgress(console, line_every_s=0.0) as progress:
            progress.aside("validation", 1, 2)
            progress.aside("validation", 2, 2)
    assert pipe.getvalue() == "[validation 1/2]\n[validation 2/2]\n"
    with ConsoleTrainingProgress(
        Console(file=terminal, force_terminal=True, width=160)
    ) as progress:
        progress.aside("validation", 1, 2)
    assert "validation" in terminal.getvalue()
    assert "1/2" in terminal.getvalue()


def test_on_a_terminal_there_is_a_bar() -> None:
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=160)
    with ConsoleTrainingProgress(console) as progress:
        progress.start("graspe small", 20, 0)
        progress.step(StepReport(12, 20, 1, 0.25, 31.4, 0.012, 7500.0))
    assert "2:05:00 left" in text.getvalue()
    assert "12/20" in text.getvalue()
