"""``graspe simulate``: recordings of a scenario, with the truth in them."""

from __future__ import annotations

import json
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from graspe_data.manifest import validate
from graspe_data.simulation.scenario import Scenario, load_scenario
from pipelines.commands.needing_open3d import needing_open3d
from pipelines.executors import Workers, one_thread
from pipelines.progress import ConsoleProgress

if TYPE_CHECKING:
    from pipelines.simulate import Simulated


class Format(StrEnum):
    """The containers of recordings."""

    BAG = "bag"
    DB3 = "db3"
    MCAP = "mcap"


def simulate(
    scenario: Annotated[str, typer.Argument(help="A scenario: a path or a shipped name.")],
    recordings: Annotated[int, typer.Option(min=1, help="How many; one a seed.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="The first seed.")] = 0,
    container: Annotated[Format, typer.Option("--format", help="The container.")] = Format.BAG,
    out: Annotated[Path, typer.Option(help="The folder they are written to.")] = Path("simulated"),
    workers: Annotated[int, typer.Option(min=1, help="Local worker processes.")] = 1,
    duration: Annotated[
        float | None, typer.Option(min=1, help="Seconds, instead of the scenario's.")
    ] = None,
    sensor_rate: Annotated[
        float | None, typer.Option(help="Pictures and clouds in a second, instead of its own.")
    ] = None,
    habits: Annotated[
        str | None,
        typer.Option(help="Write as the drivers of this robot that ships do, such as spot_ros1."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Record simulated drives of a scenario; run again, those that are there stay.

    What really happened is on the topics /truth/events and /truth/trajectories, and what would
    have happened on other arcs on /truth/candidates.
    """
    one_thread()
    with needing_open3d("graspe simulate"):
        from pipelines import simulate as simulation  # noqa: PLC0415  (Open3D is slow to load)
    chosen, robot = load_scenario(scenario)
    chosen = _changed(chosen, scenario, duration, sensor_rate)
    simulations = [
        simulation.Simulation(chosen, robot, each, container.value, habits=habits)
        for each in range(seed, seed + recordings)
    ]
    with ConsoleProgress(Console(stderr=True)) as progress:
        recordings_made = simulation.simulate(simulations, out, Workers(workers), progress)
    if as_json:
        typer.echo(json.dumps([asdict(item) for item in recordings_made], indent=2, default=str))
    else:
        _print(recordings_made, chosen.duration_s)


def _changed(
    scenario: Scenario, name: str, duration: float | None, sensor_rate: float | None
) -> Scenario:
    content, source = scenario.model_dump(), name
    if duration is not None:
        content["duration_s"], source = duration, f"{source} --duration {duration:g}"
    if sensor_rate is not None:
        content["camera"]["rate"] = content["lidar"]["rate"] = sensor_rate
        source = f"{source} --sensor-rate {sensor_rate:g}"
    return validate(content, Scenario, source)


def _print(done: list[Simulated], duration_s: float) -> None:
    table = Table("recording", "seconds", "made in", "failures")
    for item in done:
        took = "was there" if item.wall_s is None else f"{item.wall_s:.1f} s"
        failures = ", ".join(f"{count} {kind}" for kind, count in item.events.items()) or "none"
        table.add_row(str(item.path), f"{duration_s:g}", took, failures)
    Console().print(table)
