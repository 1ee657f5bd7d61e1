"""Label: an episode's motion and what people said about it to success vectors."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.documents import canonical_json
from graspe_data.errors import StageError
from graspe_data.observation.labels import (
    Annotation,
    Decided,
    OdometrySeries,
    anchor_states,
    annotation_path,
    decide,
    failing_by_events,
    label_rows,
    propose,
    read_annotation,
)
from graspe_data.simulation.recorded_truth import read_world
from pipelines.episode import EpisodeWriter, whole_column
from pipelines.motion_files import read_motion
from pipelines.stage_record import StageRecord
from pipelines.stages.stage import Stage, Work


class LabelRecord(StageRecord):
    """The record of a label stage: how many failures of each sort, and what was not judged.

    ``world`` names the scenario and seed of a simulated recording; it is empty for others.
    """

    annotated: bool
    world: str = ""
    events: dict[str, int]
    unavailable: dict[str, str]


def find_annotation(recording: Path, recording_digest: str) -> Annotation | None:
    """The labels file beside a recording, if there is one.

    Raises:
        ManifestError: The file does not validate, or belongs to another recording.
    """
    path = annotation_path(recording)
    return read_annotation(path, recording_digest) if path.is_file() else None


def _parameters(work: Work) -> dict[str, Any]:
    """The extract stage, the rules, and what the annotation says."""
    annotation, manifest = work.annotation, work.recipe.dataset
    text = canonical_json(annotation.model_dump(mode="json"), indent=None) if annotation else ""
    return {
        "extract": work.rows.key,
        "annotation": hashlib.sha256(text.encode()).hexdigest(),
        "proposals": manifest.proposals.model_dump(mode="json"),
        "labels": manifest.labels.model_dump(mode="json"),
        "horizon": manifest.horizon.model_dump(mode="json"),
    }


def label(work: Work, folder: Path, key: str) -> LabelRecord:
    """Write the label columns of an episode into an empty folder.

    Raises:
        ObservationError: Proposals nobody reviewed, and the manifest says ``unreviewed: fail``.
        StageError: An interval of the annotation lies outside the recording.
    """
    annotation, extracted, manifest = work.annotation, work.rows, work.recipe.dataset
    series = read_motion(work.episode)
    proposals = propose(series, manifest.proposals)
    if annotation is not None:
        _check_within(annotation, series.odometry.stamps_ns, extracted.recording)
    decided = decide(proposals, annotation, manifest.labels.unreviewed)
    anchors = whole_column(work.episode, "stamp_ns")
    labels = label_rows(anchors, series.odometry, decided, manifest.label_settings)
    with EpisodeWriter(folder, work.columns("label"), extracted.rows) as writer:
        writer.write_all("success", labels.success)
        writer.write_all("success_mask", labels.mask)
        writer.write_all("label_source", labels.source)
        writer.write_all("state", _states(anchors, series.odometry, decided))
        digests = writer.digests()
    return LabelRecord(
        stage="label",
        key=key,
        rows=extracted.rows,
        columns=digests,
        annotated=annotation is not None,
        world=read_world(work.path),
        events=decided.counts,
        unavailable={str(kind): reason for kind, reason in proposals.unavailable.items()},
    )


LABEL = Stage("label", 2, LabelRecord, _parameters, label)


def _states(
    anchors: NDArray[np.int64], odometry: OdometrySeries, decided: Decided
) -> NDArray[np.uint8]:
    velocity = np.stack(odometry.at(anchors)[3:], axis=1)
    return anchor_states(failing_by_events(anchors, decided), velocity)


def _check_within(annotation: Annotation, stamps_ns: NDArray[np.int64], recording: str) -> None:
    first, last = int(stamps_ns[0]), int(stamps_ns[-1])
    zero = annotation.time_zero_ns
    for number, interval in enumerate(annotation.intervals):
        event = annotation.event(interval)
        if event.stop_ns < first or event.start_ns > last:
            raise StageError(
                f"labels of {recording}: interval {number}, {interval.start_s:g} to "
                f"{interval.stop_s:g} s, lies outside the recording, which runs from "
                f"{(first - zero) / 1e9:.1f} to {(last - zero) / 1e9:.1f} s after time_zero_ns."
            )
