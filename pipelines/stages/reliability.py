"""Reliability: equations (1) to (5) on the pictures and points of an episode."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from graspe_data.observation.image_reliability import image_reliability
from graspe_data.observation.point_reliability import point_reliability
from pipelines.dataset_settings import DatasetManifest
from pipelines.episode import EpisodeWriter, StoredColumn, whole_column
from pipelines.row_columns import reliability_columns
from pipelines.stage import StageRecord, stage_key, write_record
from pipelines.stages.extract import ExtractRecord

VERSION = 1


def reliability_key(manifest: DatasetManifest, extracted: ExtractRecord) -> str:
    """The key of the reliability stage."""
    return stage_key(
        "reliability",
        VERSION,
        extract=extracted.key,
        image=manifest.image_reliability.model_dump(mode="json"),
        points=manifest.point_reliability.model_dump(mode="json"),
    )


def reliability(
    manifest: DatasetManifest, extracted: ExtractRecord, episode: Path, folder: Path
) -> StageRecord:
    """Write the reliability columns of an episode.

    Args:
        manifest: The dataset manifest.
        extracted: The record of the extract stage.
        episode: The folder of the extract stage.
        folder: An empty folder.
    """
    counts = whole_column(episode, "point_count")
    names = [column.name for column in reliability_columns()]
    values = np.empty((len(names), extracted.rows), np.float32)
    with (
        StoredColumn(episode, "image") as images,
        StoredColumn(episode, "smoothness") as smoothness,
        EpisodeWriter(folder, reliability_columns(), extracted.rows) as writer,
    ):
        for row in range(extracted.rows):
            picture = image_reliability(images.row(row), manifest.image_reliability)
            measured = smoothness.row(row)[: counts[row]]
            cloud = point_reliability(measured, manifest.point_reliability)
            found = {**vars(picture), **vars(cloud)}
            values[:, row] = [found[name] for name in names]
        for name, column in zip(names, values, strict=True):
            writer.write_all(name, column)
        digests = writer.digests()
    record = StageRecord(
        stage="reliability",
        key=reliability_key(manifest, extracted),
        rows=extracted.rows,
        columns=digests,
    )
    write_record(folder, record)
    return record
