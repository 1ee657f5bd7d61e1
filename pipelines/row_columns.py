"""The columns that a dataset's and a robot's manifest make of the catalogue."""

from __future__ import annotations

from graspe_data.columns import Column
from graspe_data.observation.catalogue import BY_NAME, StageName, columns_of
from pipelines.dataset_settings import DatasetRecipe


def stage_columns(recipe: DatasetRecipe, stage: StageName | None = None) -> list[Column]:
    """The columns of a stage, or of all stages, in the robot's own frames."""
    return columns_of(_sizes(recipe), _frames(recipe), stage)


def row_columns(recipe: DatasetRecipe) -> list[Column]:
    """Every column that a shard holds."""
    storage = recipe.dataset.storage
    kept = [
        column
        for column in stage_columns(recipe)
        if not BY_NAME[column.name].optional or column.name in storage.optional_columns
    ]
    codec = {"codec": recipe.dataset.image_codec}
    return [c.model_copy(update=codec) if c.name == "image" else c for c in kept]


def _sizes(recipe: DatasetRecipe) -> dict[str, int]:
    """The sizes that the manifest sets, by the names that the catalogue uses."""
    manifest, sizes = recipe.dataset, recipe.observation.sizes
    if (layers := manifest.intensity_layers) is not None:
        names = ("layers", "cells_ahead", "cells_across")
        sizes |= dict(zip(names, layers.shape, strict=True))
    if manifest.candidates is not None:
        sizes["candidates"] = manifest.candidates.count
    return sizes


def _frames(recipe: DatasetRecipe) -> dict[str, str]:
    robot = recipe.robot
    return {"base": robot.base_frame, "odometry": robot.odometry_frame, "camera": "camera"}
