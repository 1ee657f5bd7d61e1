"""The command ``graspe``."""

from __future__ import annotations

import sys

import typer

from graspe_data.errors import GraspeError
from pipelines.commands import (
    dataset,
    demo,
    export,
    intensity,
    labels,
    navigate,
    recordings,
    simulate,
    zoo,
)

INTERRUPTED = 130
STOPPED = "stopped. Run the same command again to go on where it stopped."

app = typer.Typer(
    name="graspe",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Raw robot recordings to a dataset you can trust.",
)
recordings.register(app)
app.add_typer(dataset.app, name="dataset")
app.add_typer(labels.app, name="label")
app.add_typer(zoo.app, name="zoo")
app.add_typer(navigate.app, name="navigate")
app.command()(demo.demo)
app.command()(export.export)
app.command()(simulate.simulate)
app.command()(intensity.intensity)


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
