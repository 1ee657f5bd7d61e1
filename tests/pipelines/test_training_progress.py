"""What a training shows on a terminal and in a pipe."""

from __future__ import annotations

import io

from rich.console import Console

from model_zoo.training.progress import StepReport
from model_zoo.training.state import EpochRecord
from pipelines.training_progress import ConsoleTrainingProgress

EPOCH = EpochRecord(epoch=0, step=0, means={"loss": 0.5}, au_roc=0.75, validation_loss=1)


def test_in_a_pipe_it_prints_plain_lines() -> None:
    text = io.StringIO()
    with ConsoleTrainingProgress(Console(file=text, width=40), line_every_s=0.0) as progress:
        progress.start("graspe small", 20, 10)
        progress.step(StepReport(12, 20, 1, 0.25, 31.4, 0.012, 75.0))
        progress.epoch(EPOCH, best=True)
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
