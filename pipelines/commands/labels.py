"""``graspe label``: propose failures for people to review."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from graspe_data.errors import GraspeError
from graspe_data.observation.labels import (
    Annotation,
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
from pipelines.commands.dataset import SOME_REFUSED, More, Recordings
from pipelines.dataset_settings import DatasetRecipe, load_recipe
from pipelines.motion_files import motion_series

app = typer.Typer(no_args_is_help=True, help="Propose failures, for people to review.")


@app.callback()
def _group() -> None:
    """Keep ``propose`` a command of its own."""


@app.command("propose")
def propose_command(
    manifest: Annotated[str, typer.Argument(help="A dataset manifest: a path or a shipped name.")],
    recordings: Recordings,
    more: More = None,
) -> None:
    """Write the labels file of each recording, beside it; what people decided stays.

    Exit code 0: every recording was read; 3: some were refused.
    """
    recipe, refused = load_recipe(manifest), 0
    for recording in find_recordings([*recordings, *(more or [])]):
        try:
            typer.echo(_propose_one(recipe, recording))
        except GraspeError as error:
            refused += 1
            typer.echo(f"refused: {error}", err=True)
    raise typer.Exit(SOME_REFUSED if refused else 0)


def _propose_one(recipe: DatasetRecipe, path: Path) -> str:
    digest = recording_digest(path)
    dataset = recipe.dataset
    with open_recording(path) as recording:
        synchronised = synchronise(recording, recipe.robot, dataset.clocks, dataset.synchronisation)
    series = motion_series(synchronised)
    proposals = propose(series, dataset.proposals)
    target = annotation_path(path)
    earlier = read_annotation(target, digest) if target.is_file() else None
    if earlier is None:
        zero = int(series.odometry.stamps_ns[0])
        draft = draft_annotation(proposals, path.name, digest, zero)
    else:
        draft = redraft_annotation(earlier, proposals)
    if earlier is None or _sorted(draft) != _sorted(earlier):
        write_annotation(target, draft)
    waiting = sum(interval.verdict == "proposed" for interval in draft.intervals)
    unjudged = "".join(f"; {kind} not judged: {why}" for kind, why in draft.not_judged.items())
    return f"{target}: {waiting} intervals to review of {len(draft.intervals)}{unjudged}"


def _sorted(annotation: Annotation) -> Annotation:
    """The same annotation whatever the order of its intervals: that alone is no change."""
    ordered = sorted(annotation.intervals, key=lambda interval: interval.model_dump_json())
    return annotation.model_copy(update={"intervals": tuple(ordered)})
