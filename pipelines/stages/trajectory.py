"""Trajectory: the ground that the current velocity would cover, drawn into the picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from graspe_data.calibration import StoredTransform, restored
from graspe_data.errors import StageError
from graspe_data.observation.trajectory import PredictedTrajectory
from pipelines.dataset_settings import DatasetRecipe
from pipelines.episode import EpisodeWriter, whole_column
from pipelines.extract_record import ExtractRecord
from pipelines.stage_record import StageRecord
from pipelines.stages.stage import Stage, Work


def trajectory_parameters(work: Work) -> dict[str, Any]:
    """What decides how a trajectory is drawn."""
    recipe = work.recipe
    return {
        "extract": work.rows.key,
        "horizon": recipe.dataset.horizon.model_dump(mode="json"),
        "width": recipe.robot.footprint.width,
        "behind": recipe.dataset.trajectory_image.behind,
    }


def trajectory(work: Work, folder: Path, key: str) -> StageRecord:
    """Write the trajectory images of an episode into an empty folder."""
    recipe, extracted, episode = work.recipe, work.rows, work.episode
    history, stamps = whole_column(episode, "velocity_history"), whole_column(episode, "stamp_ns")
    with EpisodeWriter(folder, work.columns("trajectory"), extracted.rows) as writer:
        drawers = trajectory_drawers(recipe, extracted) if extracted.rows else []
        for row in range(extracted.rows):
            v, omega = history[row, -1].tolist()
            image = next(d for until, d in drawers if stamps[row] < until).draw(v, omega)
            writer.write(row, {"trajectory_image": np.packbits(image, axis=-1)})
        digests = writer.digests()
    return StageRecord(stage="trajectory", key=key, rows=extracted.rows, columns=digests)


TRAJECTORY = Stage("trajectory", 1, StageRecord, trajectory_parameters, trajectory)


def trajectory_drawers(
    recipe: DatasetRecipe, extracted: ExtractRecord
) -> list[tuple[int, PredictedTrajectory]]:
    """What draws the trajectories of an episode, and until which stamp, ns.

    There are several where the camera was mounted anew in mid-run.

    Raises:
        StageError: The record has no calibration.
    """
    earlier = [
        (until, _drawer(recipe, extracted, (rotation, translation)))
        for until, rotation, translation in extracted.earlier_cameras
    ]
    return [*earlier, (np.iinfo(np.int64).max, predicted_trajectory(recipe, extracted))]


def predicted_trajectory(recipe: DatasetRecipe, extracted: ExtractRecord) -> PredictedTrajectory:
    """What draws trajectories by the camera's last mounting.

    Raises:
        StageError: The record has no calibration.
    """
    return _drawer(recipe, extracted, extracted.base_from_camera)


def _drawer(
    recipe: DatasetRecipe,
    extracted: ExtractRecord,
    mounted: StoredTransform | None,
) -> PredictedTrajectory:
    if extracted.camera is None or mounted is None:
        raise StageError(f"{extracted.recording}: the episode has rows but no camera calibration.")
    return PredictedTrajectory(
        intrinsics=extracted.camera,
        base_from_camera=restored(mounted),
        base_height=recipe.robot.base_height,
        line_width=recipe.robot.footprint.width,
        steps=recipe.dataset.horizon.steps,
        step_s=recipe.dataset.horizon.step_s,
        behind=recipe.dataset.trajectory_image.behind,
    )
