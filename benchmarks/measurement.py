"""What a benchmark reports: a value beside the floor or peer measured in the same run."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal


@dataclass(frozen=True)
class Measurement:
    """One number of a benchmark.

    Attributes:
        name: What was measured.
        value: How much.
        unit: Such as rows/s or ms.
        peer: The floor or the other library that it is compared with; empty where there is none.
        peer_value: The same for the peer, measured in the same run.
        target: The bound on the ratio, or on the value where there is no peer; None if only shown.
        better: Whether ``target`` is a lower bound (higher is better) or an upper one.
        note: How it was measured.
    """

    name: str
    value: float
    unit: str
    peer: str = ""
    peer_value: float | None = None
    target: float | None = None
    better: Literal["higher", "lower"] = "higher"
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """The value over the peer's."""
        return self.value / self.peer_value if self.peer_value else None

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None where there is none."""
        if self.target is None:
            return None
        judged = self.value if self.ratio is None else self.ratio
        return judged >= self.target if self.better == "higher" else judged <= self.target


def render_table(measurements: Sequence[Measurement]) -> str:
    """A Markdown table."""
    rows = [
        (
            measurement.name,
            f"{measurement.value:,.4g} {measurement.unit}",
            measurement.peer,
            "" if measurement.peer_value is None else f"{measurement.peer_value:,.4g}",
            "" if measurement.ratio is None else f"{measurement.ratio:.2f}",
            _target(measurement),
            measurement.note,
        )
        for measurement in measurements
    ]
    head = ("measurement", "value", "against", "its value", "ratio", "target", "note")
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def render_json(measurements: Sequence[Measurement]) -> str:
    """The same as JSON, with ratios and whether targets are met."""
    content = [
        {**asdict(measurement), "ratio": measurement.ratio, "met": measurement.met}
        for measurement in measurements
    ]
    return json.dumps(content, indent=2) + "\n"


def _target(measurement: Measurement) -> str:
    if measurement.target is None:
        return ""
    sign = "≥" if measurement.better == "higher" else "≤"
    return f"{sign} {measurement.target:g} {'met' if measurement.met else 'MISSED'}"
