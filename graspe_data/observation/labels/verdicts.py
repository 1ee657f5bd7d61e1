"""What people say about one recording's failures; the content of a labels file."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from graspe_data.manifest import Settings
from graspe_data.observation.labels.events import Event, EventKind

Verdict = Literal["proposed", "confirmed", "rejected", "added"]
Seconds = Annotated[float, Field(ge=-4e9, le=4e9, allow_inf_nan=False)]
Text = Annotated[str, Field(max_length=2000)]


class Interval(Settings):
    """A failure over the closed interval [start_s, stop_s], and what is thought of it.

    Seconds count from the annotation's ``time_zero_ns``. Verdicts: ``proposed`` by a rule and not
    reviewed; ``confirmed`` or ``rejected`` by a person; ``added`` by a person.
    """

    start_s: Seconds
    stop_s: Seconds
    kind: EventKind
    verdict: Verdict
    reviewer: Text = ""
    note: Text = ""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.stop_s < self.start_s:
            raise ValueError(f"stop_s {self.stop_s} is before start_s {self.start_s}")
        return self


class Annotation(Settings):
    """The labels file of one recording.

    ``sha256`` is the recording's digest, checked where it is given. ``reviewer`` stands for the
    intervals that name none. ``not_judged`` tells the reviewer which kinds no rule looked for.
    """

    recording: Text = ""
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")] | None = None
    time_zero_ns: Annotated[int, Field(ge=0, le=2**62)]
    reviewer: Text = ""
    not_judged: dict[EventKind, Text] = Field(default_factory=dict)
    intervals: tuple[Interval, ...] = ()

    @model_validator(mode="after")
    def _signed(self) -> Self:
        for index, interval in enumerate(self.intervals):
            if interval.verdict != "proposed" and not (interval.reviewer or self.reviewer):
                raise ValueError(
                    f"intervals.{index}: {interval.verdict}, but by whom? Give a reviewer, there "
                    "or at the top of the file"
                )
        return self

    def event(self, interval: Interval) -> Event:
        """An interval in the recording's own time."""
        start, stop = (
            self.time_zero_ns + round(seconds * 1e9)
            for seconds in (interval.start_s, interval.stop_s)
        )
        return Event(interval.kind, start, stop, interval.note)
