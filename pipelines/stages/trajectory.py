"""Trajectory: the ground that the current velocity would cover, drawn into the picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from graspe_data.errors import StageError
from graspe_data.geometry import Transform
from graspe_data.observation.predicted_trajectory import PredictedTrajectory
from pipelines.dataset_settings import DatasetRecipe
from pipelines.episode import EpisodeWriter, whole_column
from pipelines.row_columns import trajectory_columns
from pipelines.stage import StageRecord, stage_key, write_record
from pipelines.stages.extract import ExtractRecord

VERSION = 1


def trajectory_key(recipe: DatasetRecipe, extracted: ExtractRecord) -> str:
    """The key of the trajectory stage."""
    return stage_key(
        "trajectory",
        VERSION,
        extract=extracted.key,
        horizon=recipe.dataset.horizon.model_dump(mode="json"),
        width=recipe.robot.footprint.width,
        behind=recipe.dataset.trajectory_image.behind,
    )


def trajectory(
    recipe: DatasetRecipe, extracted: ExtractRecord, episode: Path, folder: Path
) -> StageRecord:
    """Write the trajectory images of an episode.

    Args:
        recipe: The dataset and robot manifests.
        extracted: The record of the extract stage, with the camera's calibration.
        episode: The folder of the extract stage.
        folder: An empty folder.
    """
    history, stamps = whole_column(episode, "velocity_history"), whole_column(episode, "stamp_ns")
    with EpisodeWriter(folder, trajectory_columns(recipe.dataset), extracted.rows) as writer:
        drawers = trajectory_drawers(recipe, extracted) if extracted.rows else []
        for row in range(extracted.rows):
            v, omega = history[row, -1].tolist()
            drawn = next(d for until, d in drawers if stamps[row] < until).draw(v, omega)
            writer.write(row, {"trajectory_image": np.packbits(drawn, axis=-1)})
        digests = writer.digests()
    record = StageRecord(
        stage="trajectory",
        key=trajectory_key(recipe, extracted),
        rows=extracted.rows,
        columns=digests,
    )
    write_record(folder, record)
    return record


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
    mounted: tuple[tuple[float, ...], tuple[float, ...]] | None,
) -> PredictedTrajectory:
    if extracted.camera is None or mounted is None:
        raise StageError(f"{extracted.recording}: the episode has rows but no camera calibration.")
    rotation, translation = mounted
    return PredictedTrajectory(
        intrinsics=extracted.camera,
        base_from_camera=Transform(np.reshape(rotation, (3, 3)), np.array(translation)),
        base_height=recipe.robot.base_height,
        line_width=recipe.robot.footprint.width,
        steps=recipe.dataset.horizon.steps,
        step_s=recipe.dataset.horizon.step_s,
        behind=recipe.dataset.trajectory_image.behind,
    )
