"""Extract: a recording to the sensor columns of its rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from graspe_data.calibration import StoredTransform, stored
from graspe_data.documents import file_digest
from graspe_data.geometry import Transform
from graspe_data.recordings.messages import Damage
from graspe_data.recordings.recording import open_recording
from graspe_data.robot import Vector3
from graspe_data.synchronisation.row_plan import RowPlan
from graspe_data.synchronisation.synchronised import synchronise
from pipelines.episode import EpisodeWriter
from pipelines.extract_record import ExtractRecord, FindingRecord, LossRecord
from pipelines.motion_files import motion_series, write_motion
from pipelines.stages.second_pass import SecondPass
from pipelines.stages.stage import Stage, Work


def _parameters(work: Work) -> dict[str, Any]:
    """Whatever can change a byte of the stage."""
    dataset, robot = work.recipe.dataset, work.recipe.robot
    layers = dataset.intensity_layers
    optional = {} if layers is None else {"intensity_map": layers.model_dump(mode="json")}
    if robot.lidar.angles is not None:
        optional["angles"] = {"digest": file_digest(Path(robot.lidar.angles))}
    return {
        "recording": work.digest,
        "seed": dataset.seed,
        "window": dataset.synchronisation.model_dump(mode="json"),
        "image": dataset.image.model_dump(mode="json"),
        "points": dataset.points.model_dump(mode="json"),
        "clocks": dataset.clocks.model_dump(mode="json"),
        "robot": robot.model_dump(mode="json", exclude={"name", "footprint", "recognised_by"}),
        **optional,
    }


def extract(work: Work, folder: Path, key: str) -> ExtractRecord:
    """Write the sensor columns of a recording into an empty folder.

    The recording's digest seeds the sampling of points.

    Raises:
        RecordingError: The recording cannot be opened or synchronised, or lacks calibration.
    """
    source, recipe, only = work.path, work.recipe, work.only
    with open_recording(source) as recording:
        synchronised = synchronise(
            recording, recipe.robot, recipe.dataset.clocks, recipe.dataset.synchronisation
        )
        plan = synchronised.plan
        wanted = np.ones(plan.rows, np.bool_) if only is None else np.isin(plan.anchor_ns, only)
        reading = SecondPass(recording, synchronised, recipe, work.digest, wanted)
        with EpisodeWriter(folder, work.columns("extract"), plan.rows) as writer:
            _write_planned(writer, plan)
            reasons = reading.run(writer)
            digests = writer.digests()
            rows = writer.rows
        motion = write_motion(folder, motion_series(synchronised))
        losses = dict.fromkeys((*synchronised.tracks.losses, *recording.losses, *reading.losses))
    return ExtractRecord(
        stage="extract",
        key=key,
        rows=rows,
        columns=digests,
        motion=motion,
        recording=source.name,
        time_zero_ns=int(synchronised.odometry.stamps_ns[0]),
        lost=dict(sorted((Counter(plan.lost) + reasons).items())),
        losses=tuple(_loss_record(loss, source) for loss in losses),
        offsets_ns=synchronised.offsets_ns,
        content=synchronised.tracks.content,
        camera=reading.rectifier.intrinsics if reading.rectifier else None,
        base_from_camera=_transform_record(reading.base_from_camera),
        earlier_cameras=_earlier(reading.camera_mountings),
        base_from_lidar=_transform_record(reading.base_from_lidar),
        findings=tuple(FindingRecord.of(finding) for finding in synchronised.findings),
        shifts_ns=synchronised.shifts_ns,
    )


EXTRACT = Stage("extract", 5, ExtractRecord, _parameters, extract)


def _loss_record(loss: Damage, source: Path) -> LossRecord:
    reason = loss.reason.replace(str(source), source.name)
    return LossRecord(reason=reason, topic=loss.topic, messages=loss.messages, seconds=loss.seconds)


def _transform_record(transform: Transform | None) -> StoredTransform | None:
    return None if transform is None else stored(transform)


def _earlier(
    mountings: Sequence[tuple[int, Transform]],
) -> tuple[tuple[int, tuple[float, ...], Vector3], ...]:
    ends = [since for since, _ in mountings[1:]]
    return tuple(
        (end, *stored(mounting)) for end, (_, mounting) in zip(ends, mountings, strict=False)
    )


def _write_planned(writer: EpisodeWriter, plan: RowPlan) -> None:
    """Write the columns that the plan alone decides."""
    writer.write_all("velocity_history", plan.history)
    writer.write_all("stamp_ns", plan.anchor_ns)
    writer.write_all("points_age_ns", plan.points_age_ns)
    writer.write_all("odometry_age_ns", plan.now.age_ns)
    writer.write_all("odometry_valid", np.ones(plan.rows, np.bool_))
    writer.write_all("points_valid", plan.points >= 0)
    writer.write_all("pose", plan.now.pose)
