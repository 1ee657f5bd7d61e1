"""Everything that is wrong in a labels file, in one go, each with its line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import ValidationError

from graspe_data.manifest import Settings, describe_fault
from graspe_data.observation.labels.verdicts import Annotation, Interval
from graspe_data.yaml_lines import LinedFault, LinedYaml

ROUNDING_NS = 10_000_000
"""Proposals are rounded outward to milliseconds; so much further out is still within."""
_SIGNED = ("confirmed", "rejected", "added")
M = TypeVar("M", bound=Settings)


@dataclass(frozen=True)
class CheckedLabels:
    """What could be read of a labels file, and what is wrong with it.

    Attributes:
        annotation: The file without the intervals that do not validate; None where what stands
            beside them does not.
        places: Of each interval of the annotation its place in the file, from 0.
        faults: In the order of their lines.
    """

    annotation: Annotation | None
    places: tuple[int, ...]
    faults: tuple[LinedFault, ...]


def check_labels(document: LinedYaml) -> CheckedLabels:
    """Check form, kinds, verdicts, reviewers, order and overlap of the intervals."""
    content = document.content
    if not isinstance(content, Mapping):
        found = "nothing" if content is None else type(content).__name__
        fault = LinedFault(
            document.line(()), f"expected a mapping with time_zero_ns and intervals, found {found}."
        )
        return CheckedLabels(None, (), document.faults or (fault,))
    # 1. The file without its intervals, then each interval for itself, so that none hides another.
    faults = list(document.faults)
    head = _validated(document, Annotation, {**content, "intervals": ()}, (), faults)
    raw = content.get("intervals", ())
    if not isinstance(raw, list | tuple):
        found = "nothing" if raw is None else type(raw).__name__
        line = document.line(("intervals",))
        faults.append(LinedFault(line, f"intervals: expected a list, found {found}."))
        raw = ()
    intervals: dict[int, Interval] = {}
    for place, item in enumerate(raw):
        interval = _validated(document, Interval, item, ("intervals", place), faults)
        if interval is not None:
            intervals[place] = interval
    # 2. What several of them must fulfil together.
    faults += _unsigned(document, raw, content.get("reviewer"))
    faults += _out_of_order(document, intervals)
    faults += _overlapping(document, intervals)
    annotation = head and head.model_copy(update={"intervals": tuple(intervals.values())})
    return CheckedLabels(annotation, tuple(intervals), tuple(sorted(faults)))


def outside(
    document: LinedYaml, checked: CheckedLabels, first_ns: int, last_ns: int
) -> Iterator[LinedFault]:
    """The intervals that do not lie within a recording, whose first and last stamp are given."""
    if (annotation := checked.annotation) is None:
        return
    zero = annotation.time_zero_ns
    runs = f"{(first_ns - zero) / 1e9:.2f} to {(last_ns - zero) / 1e9:.2f} s after time_zero_ns"
    for place, interval in zip(checked.places, annotation.intervals, strict=True):
        event = annotation.event(interval)
        early, late = first_ns - ROUNDING_NS > event.start_ns, last_ns + ROUNDING_NS < event.stop_ns
        if early or late:
            yield LinedFault(
                document.line(("intervals", place)),
                f"intervals.{place}: {_span(interval)} does not lie within the recording, which "
                f"runs from {runs}.",
            )


def _validated(
    document: LinedYaml,
    model: type[M],
    content: Any,
    key: tuple[str | int, ...],
    faults: list[LinedFault],
) -> M | None:
    """The content as a model; None and its faults where it does not validate."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        for fault in error.errors():
            line = document.line((*key, *fault["loc"]))
            where = ".".join(map(str, key)) + ("." if fault["loc"] else ": ") if key else ""
            text = describe_fault(fault, model).removeprefix("the whole: ")
            faults.append(LinedFault(line, where + text))
        return None


def _unsigned(document: LinedYaml, raw: Sequence[Any], everywhere: object) -> Iterator[LinedFault]:
    for place, item in enumerate(raw):
        if not isinstance(item, Mapping) or item.get("verdict") not in _SIGNED:
            continue
        if not (item.get("reviewer") or everywhere):
            yield LinedFault(
                document.line(("intervals", place, "verdict")),
                f"intervals.{place}: {item['verdict']}, but by whom? Give a reviewer, there or at "
                f"the top of the file.",
            )


def _out_of_order(document: LinedYaml, intervals: Mapping[int, Interval]) -> Iterator[LinedFault]:
    latest: int | None = None
    for place, interval in intervals.items():
        if latest is not None and interval.start_s < intervals[latest].start_s:
            above = document.line(("intervals", latest))
            yield LinedFault(
                document.line(("intervals", place)),
                f"intervals.{place}: starts at {interval.start_s:g} s, before the one above it in "
                f"line {above} ({intervals[latest].start_s:g} s). Put them in order of start_s.",
            )
        else:
            latest = place


def _overlapping(document: LinedYaml, intervals: Mapping[int, Interval]) -> Iterator[LinedFault]:
    """People's intervals of one kind that overlap: which of the verdicts holds there?"""
    reach: dict[str, int] = {}
    decided = {place: one for place, one in intervals.items() if one.verdict != "proposed"}
    for place, interval in sorted(decided.items(), key=lambda item: (item[1].start_s, item[0])):
        before = reach.setdefault(interval.kind, place)
        if before != place and interval.start_s <= intervals[before].stop_s:
            other = intervals[before]
            yield LinedFault(
                document.line(("intervals", place)),
                f"intervals.{place}: {interval.verdict} {interval.kind}, {_span(interval)}, "
                f"overlaps the {other.verdict} one of {_span(other)} in line "
                f"{document.line(('intervals', before))}. Join them, or move their ends.",
            )
        if interval.stop_s >= intervals[before].stop_s:
            reach[interval.kind] = place


def _span(interval: Interval) -> str:
    return f"{interval.start_s:g} to {interval.stop_s:g} s"
