"""``graspe label``: propose failures for people to review, check files, and score the rules."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

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
from graspe_data.synchronisation.synchronised import synchronise
from pipelines.commands.dataset import FAULTY, SOME_REFUSED, AsJson, More, Recordings
from pipelines.dataset_settings import DatasetRecipe, load_recipe
from pipelines.label_check import LabelCheck, check_labels_file, find_labels
from pipelines.label_scores import LabelScore, score_labels, sum_scores
from pipelines.motion_files import motion_series
from pipelines.score_counts import EventScore, StepScore

app = typer.Typer(
    no_args_is_help=True,
    help="Propose failures for people, check their verdicts, and score the rules.",
)


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


@app.command("check")
def check_command(
    labels: Annotated[
        Path, typer.Argument(help="A labels file, or a folder of them.", show_default=False)
    ],
    recordings: Recordings = [],  # noqa: B006
    more: More = None,
    manifest: Annotated[
        str | None,
        typer.Option(help="A dataset manifest: ends are held against the odometry, as it says."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check labels files without building: every fault at once, each with its line.

    Form, kinds, verdicts, names, order and overlap; with --recordings that they are of these and
    lie within them. Exit code 0: no fault; 2: some.
    """
    given = [*recordings, *(more or [])]
    found = find_recordings(given) if given else []
    recipe = load_recipe(manifest) if manifest else None
    checks = [check_labels_file(path, found, recipe) for path in find_labels(labels)]
    if as_json:
        typer.echo(json.dumps([_check_json(check) for check in checks], indent=2))
    else:
        for check in checks:
            _print_check(check)
    raise typer.Exit(FAULTY if any(check.faults for check in checks) else 0)


def _check_json(check: LabelCheck) -> dict[str, object]:
    return {
        "labels": str(check.path),
        "recording": None if check.recording is None else str(check.recording),
        "verdicts": check.verdicts,
        "faults": [asdict(fault) for fault in check.faults],
    }


def _print_check(check: LabelCheck) -> None:
    for fault in check.faults:
        typer.echo(f"{check.path}:{fault.line or ''}{':' if fault.line else ''} {fault.text}")
    verdicts = ", ".join(f"{count} {verdict}" for verdict, count in check.verdicts.items())
    against = f"; held against {check.recording}" if check.recording else ""
    typer.echo(
        f"{check.path}: {len(check.faults)} faults; intervals: {verdicts or 'none'}{against}"
    )


@app.command("score")
def score_command(
    recordings: Annotated[
        list[Path], typer.Argument(help="Simulated recordings, or folders of them.")
    ],
    recipe: Annotated[
        str, typer.Option(help="A dataset manifest, whose rules are scored: a path or a name.")
    ] = "graspe",
    as_json: AsJson = False,
) -> None:
    """Hold the label rules against the truth of simulated recordings.

    Exit code 0: every recording was scored; 3: some were refused.
    """
    rules, scores, refused = load_recipe(recipe), list[LabelScore](), 0
    for recording in find_recordings(recordings):
        try:
            scores.append(score_labels(rules, recording))
        except GraspeError as error:
            refused += 1
            typer.echo(f"refused: {error}", err=True)
    total = sum_scores(scores)
    if as_json:
        typer.echo(json.dumps(_score_json(total), indent=2))
    elif scores:
        _print_score(total)
    raise typer.Exit(SOME_REFUSED if refused else 0)


def _score_json(score: LabelScore) -> dict[str, object]:
    def fields(part: EventScore | StepScore, *shares: str) -> dict[str, object]:
        return asdict(part) | {share: getattr(part, share) for share in shares}

    kinds = {kind: fields(part, "precision", "recall") for kind, part in score.events.items()}
    steps = fields(score.steps, "agreement", "precision", "recall")
    return {"recordings": score.recordings, "events": kinds, "steps": steps}


def _print_score(score: LabelScore) -> None:
    table = Table("kind", "proposed", "right", "precision", "true", "found", "recall")
    for kind, part in score.events.items():
        proposed = str(part.proposed), str(part.right), _percent(part.precision)
        table.add_row(kind, *proposed, str(part.true), str(part.found), _percent(part.recall))
    Console().print(table)
    steps = score.steps
    typer.echo(
        f"steps: {steps.judged} judged of {steps.steps}; {_percent(steps.agreement)} agree with "
        f"the truth; of those labelled failing {_percent(steps.precision)} fail, of those that "
        f"fail {_percent(steps.recall)} are labelled so\nrecordings: {score.recordings}"
    )


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f} %"


def _propose_one(recipe: DatasetRecipe, path: Path) -> str:
    digest = recording_digest(path)
    recipe = recipe.for_recording(path.name)
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
