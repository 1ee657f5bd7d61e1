"""The label rules against the truth of simulated recordings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import StageError
from graspe_data.observation.labels import EventKind, decide, label_rows, propose
from graspe_data.recordings import open_recording
from graspe_data.simulation.recorded_truth import RecordedTruth, read_truth
from graspe_data.synchronisation.synchronised import synchronise
from pipelines.dataset_settings import DatasetRecipe
from pipelines.motion_files import motion_series
from pipelines.score_counts import EventScore, StepScore, score_events, score_steps

KINDS: Final[tuple[EventKind, ...]] = ("stuck", "collision", "stumble")


@dataclass(frozen=True)
class LabelScore:
    """Scores of some recordings: by kind of event, and over the steps of the rows."""

    recordings: int
    events: dict[EventKind, EventScore]
    steps: StepScore


def score_labels(recipe: DatasetRecipe, path: Path) -> LabelScore:
    """Run the rules over a simulated recording and hold them against its truth.

    Without the rule for oscillation: that is the planner's failure, of which the world knows
    nothing.

    Raises:
        RecordingError: The recording cannot be read, or holds no truth.
        StageError: The dataset's horizon is not the one of the recorded truth.
    """
    recipe = recipe.for_recording(path.name)
    truth, dataset = read_truth(path), recipe.dataset
    with open_recording(path) as recording:
        synchronised = synchronise(recording, recipe.robot, dataset.clocks, dataset.synchronisation)
    series = motion_series(synchronised)
    proposals = propose(series, dataset.proposals.model_copy(update={"oscillation": None}))
    anchors = synchronised.plan.anchor_ns
    decided = decide(proposals, None, "take")
    labels = label_rows(anchors, series.odometry, decided, dataset.label_settings)
    arcs = _arcs_at(anchors, truth, recipe, path)
    events = {kind: score_events(proposals.events, truth.events, kind) for kind in KINDS}
    return LabelScore(1, events, score_steps(labels, arcs))


def sum_scores(scores: Iterable[LabelScore]) -> LabelScore:
    """Several recordings together."""
    items = list(scores)
    events = {kind: sum((item.events[kind] for item in items), EventScore()) for kind in KINDS}
    steps = sum((item.steps for item in items), StepScore())
    return LabelScore(sum(item.recordings for item in items), events, steps)


def _arcs_at(
    anchors: NDArray[np.int64], truth: RecordedTruth, recipe: DatasetRecipe, path: Path
) -> NDArray[np.bool_]:
    horizon, steps = recipe.dataset.horizon, truth.success.shape[1]
    if horizon.step_s != truth.step_s or horizon.steps > steps:
        raise StageError(
            f"{path}: its truth is of {steps} steps of {truth.step_s:g} s; the dataset's horizon "
            f"has {horizon.steps} of {horizon.step_s:g} s. Take steps of {truth.step_s:g} s, "
            f"{steps} at most."
        )
    places = np.searchsorted(truth.stamps_ns, anchors)
    known = truth.stamps_ns[np.minimum(places, len(truth.stamps_ns) - 1)] == anchors
    if not known.all():
        raise StageError(
            f"{path}: no truth for the picture at {anchors[~known][0]} ns, so the recording was "
            f"changed after it was made. Simulate it again."
        )
    arcs: NDArray[np.bool_] = truth.success[places, : horizon.steps]
    return arcs
