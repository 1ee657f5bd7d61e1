"""The command ``graspe``."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from graspe_data.errors import GraspeError
from pipelines.lazy_commands import LazyCommand, LazyGroup

INTERRUPTED = 130
STOPPED = "stopped. Run the same command again to go on where it stopped."

_ROOM = "pipelines.commands"
COMMANDS = {
    "inspect": LazyCommand(
        f"{_ROOM}.recordings",
        "inspect",
        "Say what recordings hold, how well their clocks agree, and whether they can make rows.",
    ),
    "scaffold": LazyCommand(
        f"{_ROOM}.recordings",
        "scaffold",
        "Start a robot manifest from a recording; every guess and every gap is marked.",
    ),
    "dataset": LazyCommand(f"{_ROOM}.dataset", "app", "Build, describe and check datasets."),
    "label": LazyCommand(
        f"{_ROOM}.labels",
        "app",
        "Propose failures for people, check their verdicts, and score the rules.",
    ),
    "zoo": LazyCommand(f"{_ROOM}.zoo", "app", "List, train, evaluate and compare models."),
    "export": LazyCommand(
        f"{_ROOM}.export",
        "export",
        "Export a model for planners: ONNX graphs, contract, recorded inputs and outputs.",
    ),
    "navigate": LazyCommand(
        f"{_ROOM}.navigate", "app", "Let planners drive in the simulated field."
    ),
    "intensity": LazyCommand(
        f"{_ROOM}.intensity",
        "intensity",
        "Draw the maps of a recording: classes, planning map, layers, camera.",
    ),
    "simulate": LazyCommand(
        f"{_ROOM}.simulate",
        "simulate",
        "Record simulated drives of a scenario; run again, those that are there stay.",
    ),
    "demo": LazyCommand(
        f"{_ROOM}.demo",
        "demo",
        "Simulate drives, build a dataset, train two models, export one; run again, it goes on.",
    ),
}
"""By name; `graspe --help` imports none of them."""


class _Commands(LazyGroup):
    lazy = COMMANDS


app = typer.Typer(
    name="graspe",
    cls=_Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Raw robot recordings to a dataset you can trust.",
)


def _version(wanted: bool) -> None:
    if wanted:
        from graspe_data import __version__  # noqa: PLC0415 - asks the installed packages

        typer.echo(f"graspe {__version__}")
        raise typer.Exit


@app.callback()
def graspe(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Say it and exit.")
    ] = False,
) -> None:
    """Raw robot recordings to a dataset you can trust."""


def main() -> None:
    """Run the command line; a user's mistake is one clear text and exit code 1."""
    try:
        app(prog_name="graspe")
    except GraspeError as error:
        sys.stderr.write(f"graspe: {error}\n")
        sys.exit(1)
    except SystemExit as ended:
        if ended.code == INTERRUPTED:
            sys.stderr.write(f"graspe: {STOPPED}\n")
        raise
    except KeyboardInterrupt:
        sys.stderr.write(f"graspe: {STOPPED}\n")
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        sys.exit(141)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        sys.stderr.write(f"graspe: {where}{error.strerror or error}.\n")
        sys.exit(1)
