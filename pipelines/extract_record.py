"""What the extract stage leaves beside its columns: counts, findings, calibration, identity."""

from __future__ import annotations

from typing import Self

from graspe_data.calibration import RecordedCalibration, StoredTransform
from graspe_data.manifest import Settings
from graspe_data.recordings.identity import ContentIdentity
from graspe_data.robot import Intrinsics, Vector3
from graspe_data.synchronisation.findings import Course, Finding
from pipelines.motion_files import MOTION_FILE
from pipelines.stage_record import StageRecord


class LossRecord(Settings):
    """What a damaged recording no longer yields; see ``graspe_data.recordings.Damage``."""

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
    base_from_camera: StoredTransform | None = None
    earlier_cameras: tuple[tuple[int, tuple[float, ...], Vector3], ...] = ()
    """Mountings of the camera before the last one: until when, ns, rotation and translation."""
    base_from_lidar: StoredTransform | None = None
    """None where no cloud was read, or it was not one throughout."""
    findings: tuple[FindingRecord, ...] = ()
    shifts_ns: tuple[int, ...] = ()
    """What was added to the stamps of each stretch of the recording."""

    @property
    def calibration(self) -> RecordedCalibration:
        """What the recording told of its sensors."""
        return RecordedCalibration(
            camera=self.camera,
            base_from_camera=self.base_from_camera,
            base_from_lidar=self.base_from_lidar,
        )

    @property
    def files(self) -> dict[str, str]:
        """SHA-256 of every file of the stage, by file name."""
        return {**super().files, MOTION_FILE: self.motion}
