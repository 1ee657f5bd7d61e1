"""``graspe dataset``: build, info, verify, pack, report, picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from graspe_data.errors import ShardError
from graspe_data.inspection.manifest_lines import unfilled
from graspe_data.recordings.discovery import find_recordings
from graspe_data.shards.dataset_index import DatasetIndex, read_index
from graspe_data.shards.verify import verify_dataset
from pipelines.build import SPLITS, BuildResult, build_dataset
from pipelines.dataset_settings import load_recipe, robot_manifest
from pipelines.executors import Workers, one_thread
from pipelines.pack import TAR, Packed, pack_dataset
from pipelines.progress import ConsoleProgress
from pipelines.rederive import rederive_rows

app = typer.Typer(no_args_is_help=True, help="Build, describe and check datasets.")

SOME_REFUSED = 3
FAULTY = 2

Folder = Annotated[Path, typer.Argument(help="The dataset's folder.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Recordings = Annotated[
    list[Path],
    typer.Option("--recordings", "-r", help="Recordings, or folders of them; one or several."),
]
More = Annotated[list[Path] | None, typer.Argument(hidden=True)]


@app.command()
def build(
    manifest: Annotated[str, typer.Argument(help="A dataset manifest: a path or a shipped name.")],
    recordings: Recordings,
    out: Annotated[Path, typer.Option(help="The dataset's folder.")],
    more: More = None,
    workers: Annotated[int, typer.Option(min=1, help="Local worker processes.")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(help="A Dask scheduler, such as tcp://host:8786.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make a dataset from recordings; run again, it does only what changed.

    Exit code 0: every recording was read; 3: the dataset is made, but some were refused.
    """
    one_thread()
    recipe = load_recipe(manifest)
    if left := unfilled(robot_manifest(manifest)):
        typer.echo(
            f"the robot manifest still marks as missing: {', '.join(left)}. Fill in the values, or "
            f"delete the marks.",
            err=True,
        )
    found = find_recordings([*recordings, *(more or [])])
    with ConsoleProgress(Console(stderr=True)) as progress:
        result = build_dataset(recipe, found, out, Workers(workers, scheduler), progress)
    if as_json:
        typer.echo(json.dumps(_build_json(result), indent=2))
    else:
        _print_build(result, out)
    raise typer.Exit(SOME_REFUSED if result.refused else 0)


@app.command()
def info(folder: Folder, as_json: AsJson = False) -> None:
    """Say what a dataset holds."""
    index = read_index(folder)
    if as_json:
        typer.echo(index.model_dump_json(indent=2))
    else:
        _print_index(index)


@app.command()
def verify(
    folder: Folder,
    against_bags: Annotated[
        int, typer.Option(min=0, help="Derive so many random rows again from the recordings.")
    ] = 0,
    recordings: Recordings = [],  # noqa: B006
    more: More = None,
    seed: Annotated[int, typer.Option(help="Seed of the choice of rows.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Check every digest of a dataset, and rows against the recordings they came from."""
    faults = [str(fault) for fault in verify_dataset(folder)]
    checked, not_given = 0, ()  # type: int, tuple[str, ...]
    if against_bags:
        one_thread()
        if not recordings:
            raise ShardError("--against-bags needs --recordings: where do the recordings lie now?")
        found = find_recordings([*recordings, *(more or [])])
        result = rederive_rows(folder, found, against_bags, seed)
        checked, faults = result.rows, faults + list(result.faults)
        not_given = result.not_given
    if as_json:
        typer.echo(
            json.dumps(
                {"faults": faults, "rows_derived_again": checked, "not_given": list(not_given)},
                indent=2,
            )
        )
    else:
        for fault in faults:
            typer.echo(fault)
        again = f", {checked} rows derived again from the recordings" if against_bags else ""
        typer.echo(f"{folder}: {len(faults)} faults{again}.")
        if not_given:
            typer.echo(f"not given, so not derived again: {', '.join(not_given)}")
    raise typer.Exit(FAULTY if faults else 0)


@app.command()
def pack(
    folder: Folder,
    out: Annotated[
        Path | None,
        typer.Option(
            help="A .tar, or a folder; DATASET.tar beside the dataset.", show_default=False
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make what is sent to others: shards, index, labels, report; no episodes.

    Every shard is checked on the way. The same dataset gives the same bytes.
    """
    whole = folder.resolve()
    with ConsoleProgress(Console(stderr=True)) as progress:
        packed = pack_dataset(folder, out or whole.with_name(f"{whole.name}{TAR}"), progress)
    if as_json:
        typer.echo(json.dumps(_pack_json(packed), indent=2))
        return
    typer.echo(
        f"{folder}: {packed.bytes_before / 1e6:.1f} MB; packed {packed.bytes_after / 1e6:.1f} MB "
        f"in {len(packed.files)} files; digest {packed.digest}"
    )
    for name, size in packed.left_out.items():
        typer.echo(f"left out: {name}, {size / 1e6:.1f} MB")
    typer.echo(f"{packed.target}")


@app.command()
def report(
    folder: Folder,
    out: Annotated[Path | None, typer.Option(help="The page; report.html in the folder.")] = None,
) -> None:
    """Write a page about a dataset: balance, losses, ages, reliabilities, sample rows."""
    page = out or folder / "report.html"
    from pipelines.report import write_report  # noqa: PLC0415  (matplotlib is slow to load)

    write_report(folder, page)
    typer.echo(f"{page}")


@app.command()
def picture(
    folder: Folder,
    row: Annotated[
        int | None, typer.Argument(min=0, help="The row in its split.", show_default=False)
    ] = None,
    at: Annotated[
        tuple[str, float] | None,
        typer.Option(
            help="In place of a row: the name of a recording, and seconds since its start.",
            metavar="NAME SECONDS",
        ),
    ] = None,
    split: Annotated[
        str | None, typer.Option(help="The split: train; with --at, that of the nearest row.")
    ] = None,
    out: Annotated[Path, typer.Option(help="The PNG file.")] = Path("row.png"),
) -> None:
    """Draw one row: picture with trajectory, cloud from above, velocities, reliabilities, label.

    The row is given by its number, or by its recording and the time: --at field.bag 27.5.
    """
    from pipelines.report import find_row, write_row_picture  # noqa: PLC0415  (slow: matplotlib)

    if (row is None) == (at is None):
        raise ShardError(
            f"{folder}: which row? Give its number, or --at NAME SECONDS: one of the two."
        )
    if at is not None:
        found = find_row(folder, *at, split)
        split, row = found.split, found.row
        typer.echo(
            f"{found.recording}: nearest is {split} row {row} at {found.time_s:.2f} s, "
            f"{found.apart_s:.2f} s from {at[1]:g} s"
        )
    split, row = split or "train", row or 0
    rows = read_index(folder).rows(split)
    if row >= rows:
        raise ShardError(f"{folder}: no row {row} in {split}: it has {rows}, counted from 0.")
    write_row_picture(folder, split, row, out)
    typer.echo(f"{out}")


def _pack_json(packed: Packed) -> dict[str, object]:
    return {
        "dataset_digest": packed.digest,
        "packed": str(packed.target),
        "files": list(packed.files),
        "bytes_before": packed.bytes_before,
        "bytes_after": packed.bytes_after,
        "left_out": packed.left_out,
    }


def _build_json(result: BuildResult) -> dict[str, object]:
    return {
        "dataset_digest": result.index.dataset_digest,
        "rows": {split: result.index.rows(split) for split in result.index.splits},
        "lost": result.index.losses,
        "worked_on": list(result.worked_on),
        "refused": {refusal.path.name: refusal.reason for refusal in result.refused},
    }


def _print_build(result: BuildResult, out: Path) -> None:
    _print_index(result.index)
    for refusal in result.refused:
        typer.echo(f"refused: {refusal.reason}")
    typer.echo(f"{out}: see it with: graspe dataset report {out}")


def _print_index(index: DatasetIndex) -> None:
    table = Table("recording", "split", "rows", "lost", "failing", title=index.name)
    for entry in index.recordings:
        statistics = entry.details.get("statistics")
        failing = statistics.get("rows_failing", "") if isinstance(statistics, dict) else ""
        split = "refused" if "refused" in entry.details else (entry.split or "no rows")
        lost = sum(entry.losses.values())
        table.add_row(entry.name, split, str(entry.rows), str(lost), str(failing))
    Console().print(table)
    for entry in index.recordings:
        for course, text in entry.findings:
            if course != "agrees":
                typer.echo(f"{entry.name}: {course}: {text}")
    for reason, count in sorted(index.losses.items()):
        typer.echo(f"lost: {count} {reason}")
    rows = ", ".join(f"{split} {index.rows(split)}" for split in SPLITS if split in index.splits)
    typer.echo(f"rows: {rows}; digest {index.dataset_digest}")
    empty = [split for split in SPLITS if split in index.splits and not index.rows(split)]
    if empty:
        typer.echo(
            f"no rows in: {', '.join(empty)}. Splits are drawn by group; with few groups, declare "
            f"them under split.groups."
        )
