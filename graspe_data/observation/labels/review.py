"""From proposals and a person's verdicts to the events that label."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from graspe_data.errors import ObservationError
from graspe_data.observation.labels.events import Event
from graspe_data.observation.labels.proposals import Proposals
from graspe_data.observation.labels.verdicts import Annotation, Verdict

Unreviewed = Literal["take", "leave_out", "fail"]

SHOWN = 5


@dataclass(frozen=True)
class Decided:
    """The events that label, by who decided, each in order of time.

    ``stale`` are intervals that the annotation still has as proposed though no rule proposes
    them any more; they label nothing.
    """

    confirmed: tuple[Event, ...] = ()
    added: tuple[Event, ...] = ()
    rejected: tuple[Event, ...] = ()
    taken: tuple[Event, ...] = ()
    left_out: tuple[Event, ...] = ()
    stale: tuple[Event, ...] = ()

    @property
    def by_person(self) -> tuple[Event, ...]:
        """The failures that a person stated."""
        return self.confirmed + self.added

    @property
    def counts(self) -> dict[str, int]:
        """How many events of each sort."""
        return {name: len(events) for name, events in vars(self).items()}


def decide(proposals: Proposals, annotation: Annotation | None, unreviewed: Unreviewed) -> Decided:
    """Let a person's verdicts stand over the rules' proposals.

    A proposal is reviewed when a confirmed, rejected or added interval of its kind overlaps it;
    the person's interval then replaces it, whole. A confirmed interval is a failure even where no
    rule proposes it.

    Args:
        proposals: What the rules propose.
        annotation: The recording's labels file, where there is one.
        unreviewed: Whether proposals that nobody reviewed are taken as failures, leave their
            steps unjudged, or fail the build.

    Raises:
        ObservationError: ``fail``, and there are such proposals; the text lists them.
    """
    by_verdict = {
        verdict: _said(annotation, verdict) for verdict in ("confirmed", "added", "rejected")
    }
    verdicts = [event for events in by_verdict.values() for event in events]
    open_events = tuple(event for event in proposals.events if not event.meets(verdicts))
    if unreviewed == "fail" and open_events:
        raise ObservationError(_unreviewed_text(open_events, annotation))
    return Decided(
        **by_verdict,
        taken=open_events if unreviewed == "take" else (),
        left_out=open_events if unreviewed == "leave_out" else (),
        stale=tuple(
            event
            for event in _said(annotation, "proposed")
            if not event.meets([*proposals.events, *verdicts])
        ),
    )


def _said(annotation: Annotation | None, verdict: Verdict) -> tuple[Event, ...]:
    if annotation is None:
        return ()
    intervals = [interval for interval in annotation.intervals if interval.verdict == verdict]
    return tuple(sorted(map(annotation.event, intervals), key=lambda event: event.start_ns))


def _unreviewed_text(events: Sequence[Event], annotation: Annotation | None) -> str:
    zero, origin = (annotation.time_zero_ns, "s") if annotation else (0, "s since the epoch")
    listed = ", ".join(
        f"{event.kind} {(event.start_ns - zero) * 1e-9:.2f} to "
        f"{(event.stop_ns - zero) * 1e-9:.2f} {origin}"
        for event in events[:SHOWN]
    )
    more = f" and {len(events) - SHOWN} more" if len(events) > SHOWN else ""
    return (
        f"Labels: {len(events)} proposed failures that nobody reviewed ({listed}{more}). Run "
        "'graspe label propose' and give each a verdict, or set unreviewed to take or leave_out."
    )
