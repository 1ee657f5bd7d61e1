"""Reliability: equations (1) to (5) on the pictures and points of an episode."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from graspe_data.observation.observe import rate_picture, rate_points
from pipelines.episode import EpisodeWriter, StoredColumn, whole_column
from pipelines.stage_record import StageRecord
from pipelines.stages.stage import Stage, Work


def _parameters(work: Work) -> dict[str, Any]:
    dataset = work.recipe.dataset
    return {
        "extract": work.rows.key,
        "image": dataset.image_reliability.model_dump(mode="json"),
        "points": dataset.point_reliability.model_dump(mode="json"),
    }


def reliability(work: Work, folder: Path, key: str) -> StageRecord:
    """Write the reliability columns of an episode into an empty folder."""
    episode, extracted, manifest = work.episode, work.rows, work.recipe.dataset
    columns = work.columns("reliability")
    counts = whole_column(episode, "point_count")
    names = [column.name for column in columns]
    values = np.empty((len(names), extracted.rows), np.float32)
    asks_points = manifest.point_reliability.coverage is not None
    with (
        StoredColumn(episode, "image") as images,
        StoredColumn(episode, "points") as points,
        StoredColumn(episode, "smoothness") as smoothness,
        EpisodeWriter(folder, columns, extracted.rows) as writer,
    ):
        for row in range(extracted.rows):
            of_picture = rate_picture(images.row(row), manifest.image_reliability)
            there = points.row(row) if asks_points else None
            rated = smoothness.row(row), there, counts[row]
            of_cloud = rate_points(*rated, manifest.point_reliability)
            found = of_picture | of_cloud
            values[:, row] = [found[name] for name in names]
        for name, column in zip(names, values, strict=True):
            writer.write_all(name, column)
        digests = writer.digests()
    return StageRecord(stage="reliability", key=key, rows=extracted.rows, columns=digests)


RELIABILITY = Stage("reliability", 1, StageRecord, _parameters, reliability)
