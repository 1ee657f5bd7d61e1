"""``graspe intensity``: the intensity maps of a recording as pictures and a video."""

from __future__ import annotations

import json
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from graspe_data.errors import RecordingError, StageError
from graspe_data.manifest import validate
from graspe_data.recordings.discovery import find_recordings
from pipelines.commands.dataset import SOME_REFUSED, AsJson
from pipelines.dataset_settings import load_recipe
from pipelines.intensity.mapped_clouds import MapRequest
from pipelines.progress import ConsoleProgress

if TYPE_CHECKING:
    from pipelines.intensity.render_recording import Rendering


class Form(StrEnum):
    """How obstacles are inflated."""

    ADAPTIVE = "adaptive"
    UNIFORM = "uniform"


class Reading(StrEnum):
    """Of equation (3)."""

    SUM = "sum"
    EACH = "each"


def intensity(
    recording: Annotated[Path, typer.Argument(help="A recording, or a folder that holds one.")],
    out: Annotated[Path, typer.Option(help="The folder for the pictures.")],
    manifest: Annotated[
        str, typer.Option(help="A dataset manifest: its `intensity_map` and its robot count.")
    ] = "graspe",
    goal: Annotated[
        tuple[float, float], typer.Option(help="Metres ahead and to the left of the robot.")
    ] = (10.0, 0.0),
    inflation: Annotated[Form, typer.Option(help="The kernel.")] = Form.ADAPTIVE,
    threshold: Annotated[
        float, typer.Option(help="Gamma of equation (3), of the sensor's maximum.")
    ] = 0.6,
    reading: Annotated[
        Reading, typer.Option(help="Of (3): the layers' sum, or each.")
    ] = Reading.SUM,
    glass: Annotated[
        bool, typer.Option(help="Look for glass: layer 0 below, 1 about the lidar's plane.")
    ] = False,
    camera: Annotated[bool, typer.Option(help="Show the camera's picture too.")] = True,
    every: Annotated[int, typer.Option(min=1, help="One cloud of so many.")] = 1,
    as_json: AsJson = False,
) -> None:
    """Draw the maps of a recording: classes, planning map, layers, camera.

    Exit code 0: every cloud has a map; 3: some have none.
    """
    from pipelines.intensity.render_recording import (  # noqa: PLC0415  (matplotlib is slow to load)
        render_recording,
    )

    request = _request(
        {
            "planning": {
                "classes": {"threshold": threshold, "reading": reading.value},
                "inflation": {"form": inflation.value},
                **({} if glass else {"glass": None}),
            },
            "goal": goal,
            "camera": camera,
            "every": every,
        }
    )
    recipe = load_recipe(manifest)
    with ConsoleProgress(Console(stderr=True)) as progress:
        rendering = render_recording(_the_one(recording), recipe, request, out, progress)
    if as_json:
        typer.echo(json.dumps(asdict(rendering), indent=2, default=str))
    else:
        _print(rendering, out)
    raise typer.Exit(SOME_REFUSED if rendering.lost else 0)


def _print(rendering: Rendering, out: Path) -> None:
    typer.echo(
        f"{len(rendering.pictures)} maps in {out}, {rendering.median_ms:.1f} ms each (median)"
    )
    typer.echo(f"video: {rendering.video or 'none: OpenCV cannot write MPEG-4 here'}")
    for reason, count in rendering.lost.items():
        typer.echo(f"lost: {count} clouds: {reason}")


def _request(content: dict[str, object]) -> MapRequest:
    request = validate(content, MapRequest, "graspe intensity")
    if not any(request.goal) and request.planning.inflation.form == "adaptive":
        raise StageError("--goal 0 0: give a goal other than the robot's own place.")
    return request


def _the_one(path: Path) -> Path:
    found = find_recordings([path])
    if len(found) != 1:
        listed = ", ".join(str(one) for one in found[:20])
        raise RecordingError(f"{path}: {len(found)} recordings; name one: {listed}")
    return found[0]
