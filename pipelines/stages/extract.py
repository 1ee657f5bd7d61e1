"""Extract: a recording to the sensor columns of its rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from graspe_data.documents import file_digest
from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.recordings.content import ContentIdentity
from graspe_data.recordings.messages import Loss
from graspe_data.recordings.recording import open_recording
from graspe_data.robot import Intrinsics
from graspe_data.synchronisation.findings import Course, Finding
from graspe_data.synchronisation.row_plan import RowPlan
from graspe_data.synchronisation.synchronised import synchronise
from pipelines.dataset_settings import DatasetRecipe
from pipelines.episode import EpisodeWriter
from pipelines.motion_files import MOTION_FILE, motion_series, write_motion
from pipelines.row_columns import extract_columns
from pipelines.stage import StageRecord, stage_key, write_record
from pipelines.stages.second_pass import SecondPass

VERSION = 5


class LossRecord(Settings):
    """What a damaged recording no longer yields; see ``graspe_data.recordings.Loss``."""

    reason: str
    topic: str | None
    messages: int | None
    seconds: float | None


class FindingRecord(Settings):
    """What was held against what; see ``graspe_data.synchronisation.findings.Finding``."""

    kind: str
    course: Course
    where: str
    text: str
    numbers: dict[str, float]

    @classmethod
    def of(cls, finding: Finding) -> Self:
        """The record of a finding."""
        numbers = {name: float(value) for name, value in finding.numbers.items()}
        return cls(
            kind=finding.kind,
            course=finding.course,
            where=finding.where,
            text=finding.text,
            numbers=numbers,
        )


class ExtractRecord(StageRecord):
    """The record of an extract stage."""

    recording: str
    motion: str
    """SHA-256 of the motion file."""
    time_zero_ns: int
    """The first stamp of the odometry, from which the seconds of a labels file count."""
    lost: dict[str, int]
    losses: tuple[LossRecord, ...]
    offsets_ns: dict[str, int]
    content: ContentIdentity = ContentIdentity()
    camera: Intrinsics | None = None
    """Of the stored picture."""
    base_from_camera: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    """Rotation, row by row, and translation."""
    earlier_cameras: tuple[tuple[int, tuple[float, ...], tuple[float, ...]], ...] = ()
    """Mountings of the camera before the last one: until when, ns, rotation and translation."""
    base_from_lidar: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    """The same of the lidar; None where no cloud was read, or it was not one throughout."""
    findings: tuple[FindingRecord, ...] = ()
    shifts_ns: tuple[int, ...] = ()
    """What was added to the stamps of each stretch of the recording."""

    @property
    def files(self) -> dict[str, str]:
        """SHA-256 of every file of the stage, by file name."""
        return {**super().files, MOTION_FILE: self.motion}


def extract_key(recipe: DatasetRecipe, recording_digest: str) -> str:
    """The key of the extract stage: whatever can change a byte of it."""
    dataset, robot = recipe.dataset, recipe.robot
    layers = dataset.intensity_layers
    optional = {} if layers is None else {"intensity_map": layers.model_dump(mode="json")}
    if robot.lidar.angles is not None:
        optional["angles"] = {"digest": file_digest(Path(robot.lidar.angles))}
    return stage_key(
        "extract",
        VERSION,
        recording=recording_digest,
        seed=dataset.seed,
        window=dataset.synchronisation.model_dump(mode="json"),
        image=dataset.image.model_dump(mode="json"),
        points=dataset.points.model_dump(mode="json"),
        clocks=dataset.clocks.model_dump(mode="json"),
        robot=robot.model_dump(mode="json", exclude={"name", "footprint", "recognised_by"}),
        **optional,
    )


def extract(
    source: Path,
    recording_digest: str,
    recipe: DatasetRecipe,
    folder: Path,
    only: NDArray[np.int64] | None = None,
) -> ExtractRecord:
    """Write the extract columns of a recording into a folder.

    Args:
        source: The recording.
        recording_digest: Its digest; seeds the sampling of points.
        recipe: The dataset and robot manifests.
        folder: An empty folder.
        only: Stamps of the anchors to make rows of; None for all.

    Raises:
        RecordingError: The recording cannot be opened or synchronised, or lacks calibration.
    """
    with open_recording(source) as recording:
        synchronised = synchronise(
            recording, recipe.robot, recipe.dataset.clocks, recipe.dataset.synchronisation
        )
        plan = synchronised.plan
        wanted = np.ones(plan.rows, np.bool_) if only is None else np.isin(plan.anchor_ns, only)
        reading = SecondPass(recording, synchronised, recipe, recording_digest, wanted)
        columns = extract_columns(recipe)
        with EpisodeWriter(folder, columns, plan.rows) as writer:
            _write_planned(writer, plan)
            lost = reading.run(writer)
            digests = writer.digests()
            rows = writer.rows
        motion = write_motion(folder, motion_series(synchronised))
        losses = dict.fromkeys((*synchronised.tracks.losses, *recording.losses, *reading.losses))
    record = ExtractRecord(
        stage="extract",
        key=extract_key(recipe, recording_digest),
        rows=rows,
        columns=digests,
        motion=motion,
        recording=source.name,
        time_zero_ns=int(synchronised.odometry.stamps_ns[0]),
        lost=dict(sorted((Counter(plan.lost) + lost).items())),
        losses=tuple(_loss_record(loss, source) for loss in losses),
        offsets_ns=synchronised.offsets_ns,
        content=synchronised.tracks.content,
        camera=reading.rectifier.intrinsics if reading.rectifier else None,
        base_from_camera=_flat(reading.base_from_camera),
        earlier_cameras=_earlier(reading.camera_mountings),
        base_from_lidar=_flat(reading.base_from_lidar),
        findings=tuple(FindingRecord.of(finding) for finding in synchronised.findings),
        shifts_ns=synchronised.shifts_ns,
    )
    write_record(folder, record)
    return record


def _loss_record(loss: Loss, source: Path) -> LossRecord:
    reason = loss.reason.replace(str(source), source.name)
    return LossRecord(reason=reason, topic=loss.topic, messages=loss.messages, seconds=loss.seconds)


def _flat(transform: Transform | None) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    if transform is None:
        return None
    return tuple(transform.rotation.ravel().tolist()), tuple(transform.translation.tolist())


def _earlier(
    mountings: Sequence[tuple[int, Transform]],
) -> tuple[tuple[int, tuple[float, ...], tuple[float, ...]], ...]:
    ends = [since for since, _ in mountings[1:]]
    return tuple(
        (end, tuple(mount.rotation.ravel().tolist()), tuple(mount.translation.tolist()))
        for end, (_, mount) in zip(ends, mountings, strict=False)
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
