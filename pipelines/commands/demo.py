"""``graspe demo``: the whole way on recordings that it writes itself."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from pipelines.demo import run_demo
from pipelines.executors import Workers, one_thread
from pipelines.progress import ConsoleProgress


def demo(
    out: Annotated[Path, typer.Option(help="Where everything is written.")] = Path("demo"),
    workers: Annotated[int, typer.Option(min=1, help="Local worker processes.")] = 2,
) -> None:
    """Write recordings in all three containers, build a dataset of them and a report."""
    one_thread()
    with ConsoleProgress(Console(stderr=True)) as progress:
        result = run_demo(out, Workers(workers), progress)
    dataset = out / "dataset"
    page = dataset / "report.html"
    from pipelines.report import write_report  # noqa: PLC0415  (matplotlib is slow to load)

    write_report(dataset, page)
    program = "graspe" if shutil.which("graspe") else sys.argv[0]
    rows = ", ".join(f"{split} {result.index.rows(split)}" for split in result.index.splits)
    typer.echo(
        f"recordings: {out / 'recordings'}\ndataset:    {dataset} ({rows} rows)\n"
        f"report:     {page}\n"
        f"Next:\n  {program} inspect {out / 'recordings'}\n"
        f"  {program} dataset verify {dataset} --against-bags 20 --recordings "
        f"{out / 'recordings'}"
    )
