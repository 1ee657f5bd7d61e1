"""The annotation that a person is asked to review."""

from __future__ import annotations

from graspe_data.observation.labels.events import Event
from graspe_data.observation.labels.proposals import Proposals
from graspe_data.observation.labels.verdicts import Annotation, Interval


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
    asked = [
        _interval(event, earlier.time_zero_ns)
        for event in proposals.events
        if not event.meets(events)
    ]
    intervals = sorted([*decided, *asked], key=lambda interval: interval.start_s)
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
