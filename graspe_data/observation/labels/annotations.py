"""Labels files: drafted, read and written. Nothing else of the observation touches files."""

from __future__ import annotations

from pathlib import Path

import yaml

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ManifestError
from graspe_data.manifest import load_manifest
from graspe_data.observation.labels.events import Event
from graspe_data.observation.labels.proposals import Proposals
from graspe_data.observation.labels.verdicts import Annotation, Interval

HEADING = """\
# Failures in one recording. The rules proposed; a person decides. For each interval set
# verdict to confirmed or rejected, and name the reviewer; put in what was missed as added.
# kind: stuck, collision, oscillation, stumble, other. Seconds count from time_zero_ns.
"""


def annotation_path(recording: Path) -> Path:
    """Where the labels of a recording, a file or a folder, lie: beside it."""
    named = recording.name not in ("", "..")
    whole = recording if named else recording.resolve()
    return whole.with_name(f"{whole.name}.labels.yaml")


def read_annotation(path: Path, sha256: str | None = None) -> Annotation:
    """Read and validate a labels file.

    Args:
        path: The file.
        sha256: Digest of the recording at hand, compared with the file's where it gives one.

    Raises:
        ManifestError: Names the file, the interval and key, what was found and what fits; or the
            file belongs to another recording.
    """
    annotation = load_manifest(path, Annotation)
    if sha256 and annotation.sha256 and annotation.sha256 != sha256:
        raise ManifestError(
            f"{path}: labels of another recording: expected sha256 {annotation.sha256}, the "
            f"recording has {sha256}. Label this recording, or remove the key sha256 where the "
            "recording was only packed anew and its stamps are the same."
        )
    return annotation


def write_annotation(path: Path, annotation: Annotation) -> None:
    """Write a labels file, whole or not at all.

    Raises:
        ManifestError: The file cannot be written.
    """
    content = annotation.model_dump(mode="json", exclude_defaults=True)
    text = HEADING + yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=100)
    write_atomically(path, [text.encode("utf-8")], ManifestError)


def draft_annotation(
    proposals: Proposals, recording: str, sha256: str | None, time_zero_ns: int
) -> Annotation:
    """Put every proposal to a person; times are rounded outward to milliseconds.

    Args:
        proposals: What the rules propose.
        recording: Name of its file or folder.
        sha256: Digest of the recording.
        time_zero_ns: What the seconds count from, such as the recording's first stamp.
    """
    return Annotation(
        recording=recording,
        sha256=sha256,
        time_zero_ns=time_zero_ns,
        not_judged=dict(proposals.unavailable),
        intervals=tuple(_interval(event, time_zero_ns) for event in proposals.events),
    )


def redraft_annotation(earlier: Annotation, proposals: Proposals) -> Annotation:
    """Keep what people decided, and replace what nobody reviewed by the proposals of today.

    A proposal that a decided interval of its kind overlaps is not asked about again.
    """
    decided = [interval for interval in earlier.intervals if interval.verdict != "proposed"]
    events = [earlier.event(interval) for interval in decided]
    undecided = [
        _interval(event, earlier.time_zero_ns)
        for event in proposals.events
        if not event.meets(events)
    ]
    intervals = sorted([*decided, *undecided], key=lambda interval: interval.start_s)
    return earlier.model_copy(
        update={"intervals": tuple(intervals), "not_judged": dict(proposals.unavailable)}
    )


def _interval(event: Event, time_zero_ns: int) -> Interval:
    return Interval(
        start_s=(event.start_ns - time_zero_ns) // 10**6 / 1e3,
        stop_s=-((time_zero_ns - event.stop_ns) // 10**6) / 1e3,
        kind=event.kind,
        verdict="proposed",
        note=event.evidence,
    )
