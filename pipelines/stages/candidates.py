"""Candidates: what the world says of other trajectories than the driven one, where it is known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import StageError
from graspe_data.known_outcomes import KnownOutcomes, read_outcomes
from pipelines.dataset_settings import CandidateSettings, DatasetRecipe
from pipelines.episode import EpisodeWriter, whole_column
from pipelines.extract_record import ExtractRecord
from pipelines.stage_record import StageRecord, stage_key
from pipelines.stages.stage import Stage, Work
from pipelines.stages.trajectory import TRAJECTORY, predicted_trajectory, trajectory_parameters

TOLERANCE_NS = 1_000_000


def _settings(recipe: DatasetRecipe) -> CandidateSettings:
    if recipe.dataset.candidates is None:
        raise TypeError("the manifest asks for no candidates")
    return recipe.dataset.candidates


def _parameters(work: Work) -> dict[str, Any]:
    trajectory = stage_key("trajectory", TRAJECTORY.version, **trajectory_parameters(work))
    return {"drawn": trajectory, "asked": _settings(work.recipe).model_dump(mode="json")}


def candidates(work: Work, folder: Path, key: str) -> StageRecord:
    """Write the candidates of an episode's rows, drawn as the driven trajectory is.

    A row without an answer within 1 ms of its anchor has no candidates: its mask is all False.

    Raises:
        RecordingError: The recording has no such topic.
        StageError: It knows of fewer candidates, or of other steps, than the dataset asks for.
    """
    source, recipe, extracted, episode = work.path, work.recipe, work.rows, work.episode
    settings = _settings(recipe)
    outcomes = read_outcomes(source, settings.topic)
    _check(outcomes, recipe, settings, extracted)
    with EpisodeWriter(folder, work.columns("candidates"), extracted.rows) as writer:
        moments = _nearest(outcomes, whole_column(episode, "stamp_ns"))
        predicted = predicted_trajectory(recipe, extracted) if extracted.rows else None
        for row, moment in enumerate(moments.tolist()):
            if moment < 0 or predicted is None:
                continue
            velocities = outcomes.velocities[moment, : settings.count].astype(np.float32)
            images = [predicted.draw(v, omega) for v, omega in velocities.tolist()]
            writer.write(
                row,
                {
                    "candidate_velocity": velocities,
                    "candidate_image": np.packbits(np.stack(images), axis=-1),
                    "candidate_success": outcomes.success[moment, : settings.count].astype(
                        np.uint8
                    ),
                    "candidate_mask": np.ones(settings.count, np.bool_),
                },
            )
        digests = writer.digests()
    return StageRecord(stage="candidates", key=key, rows=extracted.rows, columns=digests)


CANDIDATES = Stage(
    "candidates",
    1,
    StageRecord,
    _parameters,
    candidates,
    lambda recipe: recipe.dataset.candidates is not None,
)


def _nearest(outcomes: KnownOutcomes, stamps_ns: NDArray[np.int64]) -> NDArray[np.intp]:
    """The moment of each stamp, -1 where none is near."""
    if not outcomes.stamps_ns.size:
        return np.full(stamps_ns.size, -1, np.intp)
    apart = np.abs(outcomes.stamps_ns[None] - stamps_ns[:, None])
    nearest = apart.argmin(axis=1)
    return np.where(apart.min(axis=1) <= TOLERANCE_NS, nearest, -1)


def _check(
    outcomes: KnownOutcomes,
    recipe: DatasetRecipe,
    settings: CandidateSettings,
    extracted: ExtractRecord,
) -> None:
    horizon = recipe.dataset.horizon
    topic, (number, steps) = settings.topic, outcomes.success.shape[1:]
    if number < settings.count:
        raise StageError(
            f"{extracted.recording}: {topic} knows of {number} candidates at a time, "
            f"`candidates.count` is {settings.count}: lower it to {number}."
        )
    if (steps, outcomes.step_s) != (horizon.steps, horizon.step_s):
        raise StageError(
            f"{extracted.recording}: {topic} judges {steps} steps of {outcomes.step_s:g} s, the "
            f"dataset's horizon is {horizon.steps} of {horizon.step_s:g} s."
        )
