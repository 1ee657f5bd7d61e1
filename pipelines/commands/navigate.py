"""``graspe navigate``: closed-loop trials of planners in the simulated field."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import StageError
from graspe_data.manifest import load_manifest
from graspe_data.simulation.scenario import load_scenario
from pipelines.commands.needing_open3d import needing_open3d
from pipelines.executors import Workers, one_thread
from pipelines.progress import ConsoleProgress

if TYPE_CHECKING:
    from pipelines.trials.config import Conditions, TrialConfig
    from pipelines.trials.results import TrialGroup
    from pipelines.trials.trial import Trial

app = typer.Typer(no_args_is_help=True, help="Let planners drive in the simulated field.")

Out = Annotated[Path, typer.Option(help="The folder of the trials.")]
Folder = Annotated[Path, typer.Argument(help="A folder of `graspe navigate run`.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@app.command("run")
def run_command(
    scenario: Annotated[str, typer.Argument(help="A scenario: a path or a name.")],
    methods: Annotated[
        list[str],
        typer.Option(
            "--method",
            help="dwa_fox, dwa_lab, mim, mim_printed, mim_uniform, dwa_map, glass_slam, "
            "NAME=BUNDLE, a bundle or a folder of them; truth=BUNDLE asks the world instead of "
            "the model; repeat.",
        ),
    ],
    out: Out = Path("trials"),
    trials: Annotated[int, typer.Option(min=1, help="Of each method; one a seed.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="The first seed.")] = 1000,
    goal: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="X Y", help="Metres, in the world; without it the scenario's."),
    ] = None,
    condition: Annotated[
        str | None,
        typer.Option(help="What ails the sensors in mid-drive: a condition, a path or a name."),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="Settings of trials and planners, YAML.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Local worker processes.")] = 1,
    threads: Annotated[int, typer.Option(min=1, help="Of rays and models, in each worker.")] = 1,
    record: Annotated[bool, typer.Option(help="Record each trial as a bag beside it.")] = False,
    as_json: AsJson = False,
) -> None:
    """Run trials with the same seeds for all methods; those that are there stay.

    Under a condition, worlds and seeds are the same as without. Seeds are left out in whose worlds
    something stands at the goal.
    """
    one_thread()
    with _needing_simulation():
        from pipelines.trials import config as settings  # noqa: PLC0415
        from pipelines.trials import run_trials as running  # noqa: PLC0415
        from pipelines.trials.methods import parse_methods  # noqa: PLC0415
        from pipelines.trials.seeds import fair_seeds  # noqa: PLC0415
    trial_config = (
        settings.TrialConfig() if config is None else load_manifest(config, settings.TrialConfig)
    )
    conditions = _conditions(scenario, trial_config, goal, condition)
    tasks = [
        running.TrialTask(conditions, each, method, trial_config, record, threads)
        for each in fair_seeds(conditions, seed, trials)
        for method in parse_methods(methods)
    ]
    with ConsoleProgress(Console(stderr=True)) as progress:
        finished = running.run_trials(tasks, out, Workers(workers), progress)
    if as_json:
        typer.echo(json.dumps([trial.model_dump(mode="json") for trial in finished], indent=1))
    else:
        _print(finished)


def _conditions(
    scenario: str, config: TrialConfig, goal: tuple[float, float] | None, condition: str | None
) -> Conditions:
    """What all methods drive under."""
    from pipelines.trials.condition import load_condition, under  # noqa: PLC0415
    from pipelines.trials.config import Conditions  # noqa: PLC0415
    from pipelines.trials.run_trial import trial_scenario  # noqa: PLC0415

    base, robot = load_scenario(scenario)
    prepared = trial_scenario(base, config.trial, goal)
    ailing = load_condition(condition) if condition else None
    return Conditions(
        scenario=under(prepared, ailing) if ailing else prepared,
        robot=robot,
        trial=config.trial,
        condition=ailing.name if ailing else "",
    )


@app.command("table")
def table_command(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option(help="Folder of navigation.md and .csv; default: the trials'.")
    ] = None,
    methods: Annotated[
        list[str] | None, typer.Option("--method", help="Only these, in this order; repeat.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make the tables of all trials of a folder: success, length, collisions, time, rate."""
    with _needing_simulation():
        from pipelines.trials import results, table  # noqa: PLC0415
    counted = results.cells(results.read_trials(folder), methods or ())
    place = out or folder
    place.mkdir(parents=True, exist_ok=True)
    write_atomically(place / "navigation.csv", [table.render_csv(counted).encode()], StageError)
    shown = table.render_markdown(counted)
    write_atomically(place / "navigation.md", [shown.encode()], StageError)
    typer.echo(json.dumps(table.table_records(counted), indent=1) if as_json else shown)


@app.command("picture")
def picture_command(
    folder: Folder,
    scenario: Annotated[str, typer.Argument(help="The name of a scenario there.")],
    seed: Annotated[int, typer.Argument(min=0, help="The seed of the world.")],
    out: Annotated[Path | None, typer.Option(help="The PNG; default: beside the trials.")] = None,
) -> None:
    """Draw a world from above with the ways that all methods took."""
    with _needing_simulation():
        from pipelines.trials.picture import write_trial_picture  # noqa: PLC0415
    file = out or folder / scenario / f"{seed}.png"
    typer.echo(write_trial_picture(folder, scenario, seed, file))


def _print(done: list[Trial]) -> None:
    from pipelines.trials.results import cells  # noqa: PLC0415

    table = Table("method", "trials", "success", "length", "failures")
    for cell in cells(done, list(dict.fromkeys(trial.method for trial in done))):
        table.add_row(cell.method, str(len(cell.trials)), *_figures(cell))
    Console().print(table)


def _figures(cell: TrialGroup) -> tuple[str, str, str]:
    low, high = cell.interval
    length = "" if cell.normalised_length is None else f"{cell.normalised_length:.2f}"
    ends = [f"{count} {end}" for end, count in cell.outcomes.items() if end != "success"]
    return f"{cell.rate:.0%} ({low:.0%} to {high:.0%})", length, ", ".join(ends) or "none"


@contextmanager
def _needing_simulation() -> Iterator[None]:
    """Around imports: say what to install where Open3D or onnxruntime is missing."""
    try:
        with needing_open3d("graspe navigate"):
            yield
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "onnxruntime":
            raise
        raise StageError(
            "graspe navigate asks bundles with onnxruntime, which is not installed: "
            "pip install 'graspe[planner]'."
        ) from error
