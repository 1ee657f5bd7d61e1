"""``graspe demo``: the whole way, from simulated recordings to a dataset, a report and models."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from pipelines.commands.needing_open3d import needing_open3d
from pipelines.commands.zoo import ConsoleZooProgress, needing_torch
from pipelines.executors import Workers, one_thread
from pipelines.progress import ConsoleProgress

if TYPE_CHECKING:
    from pipelines.demo_zoo import DemoModels


def demo(
    out: Annotated[Path, typer.Option(help="Where everything is written.")] = Path("demo"),
    workers: Annotated[int, typer.Option(min=1, help="Local worker processes.")] = 2,
    train: Annotated[bool, typer.Option(help="Train and compare two models as well.")] = True,
) -> None:
    """Simulate drives, build a dataset, train two models, export one; run again, it goes on."""
    one_thread()
    with needing_open3d("graspe demo"):
        from pipelines.demo import run_demo  # noqa: PLC0415  (Open3D is slow to load)
    if train:
        with needing_torch():
            from pipelines.demo_zoo import run_demo_zoo  # noqa: PLC0415  (torch is slow to load)
    with ConsoleProgress(Console(stderr=True)) as progress:
        result = run_demo(out, Workers(workers), progress)
    dataset = out / "dataset"
    page = dataset / "report.html"
    from pipelines.report import write_report  # noqa: PLC0415  (matplotlib is slow to load)

    write_report(dataset, page)
    models = run_demo_zoo(out, workers, ConsoleZooProgress()) if train else None
    program = "graspe" if shutil.which("graspe") else sys.argv[0]
    rows = ", ".join(f"{split} {result.index.rows(split)}" for split in result.index.splits)
    typer.echo(
        f"recordings: {out / 'recordings'}\ndataset:    {dataset} ({rows} rows)\n"
        f"report:     {page}\n"
        + (_model_lines(models) if models else "")
        + f"Next:\n  {program} inspect {out / 'recordings'}\n"
        f"  {program} dataset verify {dataset} --against-bags 20 --recordings "
        f"{out / 'recordings'}"
    )


def _model_lines(models: DemoModels) -> str:
    return (
        f"models:     {models.comparison}\nbundle:     {models.bundle}\n"
        f"candidates: {models.candidates}\n"
    )
