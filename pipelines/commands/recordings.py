"""``graspe inspect`` and ``graspe scaffold``: what recordings hold, and a first robot manifest."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from graspe_data.errors import RecordingError
from graspe_data.inspection.inspection import Inspection, inspect_recording
from graspe_data.inspection.scaffolding import scaffold_robot
from graspe_data.manifest import find_manifest
from graspe_data.recordings.discovery import find_recordings
from graspe_data.robot import load_robot
from pipelines.commands.inspection_text import print_inspection

SOME_UNREADABLE = 3
CANDIDATES_SHOWN = 20


def inspect(
    paths: Annotated[
        list[Path], typer.Argument(help="Recordings, or folders of them.", show_default=False)
    ],
    robot: Annotated[
        str | None, typer.Option(help="A robot manifest to judge by: a path or a shipped name.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Say what recordings hold, how well their clocks agree, and whether they can make rows.

    Exit code 0: every recording was read; 3: some were not.
    """
    manifest = None if robot is None else load_robot(find_manifest("robots", robot))
    console, inspections = Console(), list[Inspection]()
    recordings, unreadable = _find(paths)
    for path in recordings:
        try:
            inspection = inspect_recording(path, manifest)
        except RecordingError as error:
            unreadable[str(path)] = str(error)
            continue
        inspections.append(inspection)
        if not as_json:
            print_inspection(console, inspection)
            console.print()
    if as_json:
        found = [inspection.to_json() for inspection in inspections]
        typer.echo(json.dumps({"recordings": found, "unreadable": unreadable}, indent=2))
    else:
        for reason in unreadable.values():
            typer.echo(f"cannot be read: {reason}")
    raise typer.Exit(SOME_UNREADABLE if unreadable else 0)


def scaffold(
    recording: Annotated[
        Path, typer.Argument(help="A recording, or a folder that holds one.", show_default=False)
    ],
    out: Annotated[
        Path | None, typer.Option(help="The file to write; it must not exist. Prints without.")
    ] = None,
    resolve: Annotated[
        bool, typer.Option("--resolve", help="Write mountings and intrinsics as numbers.")
    ] = False,
) -> None:
    """Start a robot manifest from a recording; every guess and every gap is marked."""
    if out is not None and out.exists():
        raise RecordingError(f"{out}: exists already; choose another name, or remove it.")
    text = scaffold_robot(_the_one(recording), resolve=resolve)
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise RecordingError(f"{out}: cannot be written: {error.strerror}.") from error
    typer.echo(f"{out}: look for `guess` and `missing`, then name it in a dataset manifest.")


def _the_one(path: Path) -> Path:
    """The recording at a path, or the only one below it."""
    first, *others = find_recordings([path])
    if not others:
        return first
    shown = "\n".join(f"  {found}" for found in [first, *others][:CANDIDATES_SHOWN])
    more = len(others) + 1 - CANDIDATES_SHOWN
    raise RecordingError(
        f"{path}: {len(others) + 1} recordings, and a robot manifest is begun from one. "
        f"Name one of them:\n{shown}" + (f"\n  and {more} more" if more > 0 else "")
    )


def _find(paths: list[Path]) -> tuple[list[Path], dict[str, str]]:
    """The recordings below some paths, each once, and the paths that have none."""
    recordings: dict[Path, None] = {}
    unreadable: dict[str, str] = {}
    for path in paths:
        try:
            recordings.update(dict.fromkeys(find_recordings([path])))
        except RecordingError as error:
            unreadable[str(path)] = str(error)
    return list(recordings), unreadable
