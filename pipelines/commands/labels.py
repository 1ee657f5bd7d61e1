"""``graspe label``: propose failures for people to review."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from graspe_data.observation.labels import (
    annotation_path,
    draft_annotation,
    propose,
    read_annotation,
    redraft_annotation,
    write_annotation,
)
from graspe_data.recordings import open_recording, recording_digest
from graspe_data.recordings.discovery import find_recordings
from graspe_data.recordings.synchronised import synchronise
from pipelines.dataset_settings import DatasetRecipe, load_recipe
from pipelines.motion_files import motion_series

app = typer.Typer(no_args_is_help=True, help="Propose failures, for people to review.")


@app.callback()
def _group() -> None:
    """Keep ``propose`` a command of its own."""


@app.command("propose")
def propose_command(
    manifest: Annotated[str, typer.Argument(help="A dataset manifest: a path or a shipped name.")],
    recordings: Annotated[list[Path], typer.Option("--recordings", "-r", help="Recordings.")],
) -> None:
    """Write the labels file of each recording, beside it; what people decided stays."""
    recipe = load_recipe(manifest)
    for recording in find_recordings(recordings):
        typer.echo(_propose_one(recipe, recording))


def _propose_one(recipe: DatasetRecipe, path: Path) -> str:
    digest = recording_digest(path)
    dataset = recipe.dataset
    with open_recording(path) as recording:
        synchronised = synchronise(recording, recipe.robot, dataset.clocks, dataset.synchronisation)
    series = motion_series(synchronised, recipe.robot.base_frame)
    proposals = propose(series, dataset.proposals)
    target = annotation_path(path)
    if target.is_file():
        draft = redraft_annotation(read_annotation(target, digest), proposals)
    else:
        zero = int(series.odometry.stamps_ns[0])
        draft = draft_annotation(proposals, path.name, digest, zero)
    write_annotation(target, draft)
    waiting = sum(interval.verdict == "proposed" for interval in draft.intervals)
    unjudged = "".join(f"; {kind} not judged: {why}" for kind, why in draft.not_judged.items())
    return f"{target}: {waiting} intervals to review of {len(draft.intervals)}{unjudged}"
