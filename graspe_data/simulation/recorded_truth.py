"""What a simulated recording knows of itself: its failures, and how every arc would have ended."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import RecordingError
from graspe_data.manifest import Settings
from graspe_data.observation.labels import Annotation, Event, Interval
from graspe_data.recordings import open_recording, recording_digest

SCENARIO_TOPIC = "/truth/scenario"
EVENTS_TOPIC = "/truth/events"
TRAJECTORIES_TOPIC = "/truth/trajectories"
CANDIDATES_TOPIC = "/truth/candidates"
HEADING = """\
# What really happened in one simulated recording, in the format of labels files. Nothing reads it
# by itself: copied to <recording>.labels.yaml, it is as if a person had seen everything.
"""


@dataclass(frozen=True)
class RecordedTruth:
    """The truth about one recording.

    ``events``: the failures, stamps in ns. ``stamps_ns`` int64 (P,): those of the pictures.
    ``success`` bool (P, T): whether the arc at the constant velocity of that moment succeeds until
    the end of each step of ``step_s`` seconds.
    """

    events: tuple[Event, ...]
    stamps_ns: NDArray[np.int64]
    success: NDArray[np.bool_]
    step_s: float

    def trajectory_texts(self) -> Iterator[str]:
        """The message of every picture's arc."""
        for stamp, success in zip(self.stamps_ns.tolist(), self.success.tolist(), strict=True):
            record = {"stamp_ns": stamp, "step_s": self.step_s, "success": list(map(int, success))}
            yield json.dumps(record)

    def events_text(self) -> str:
        """The message of all failures."""
        return json.dumps([asdict(event) for event in self.events])


def read_truth(recording: Path) -> RecordedTruth:
    """Read the truth out of a simulated recording.

    Raises:
        RecordingError: It has no such topics, or they do not say what they should.
    """
    events, arcs = _texts(recording, EVENTS_TOPIC), _texts(recording, TRAJECTORIES_TOPIC)
    if not events or not arcs:
        raise RecordingError(
            f"{recording}: nothing on {EVENTS_TOPIC} or {TRAJECTORIES_TOPIC}, so its truth is not "
            f"known: score whole recordings of `graspe simulate`."
        )
    try:
        failures = tuple(Event(**records) for text in events for records in json.loads(text))
        records = [json.loads(text) for text in arcs]
        stamps = np.array([arc["stamp_ns"] for arc in records], np.int64)
        success = np.array([arc["success"] for arc in records], np.bool_)
        (step_s,) = {float(arc["step_s"]) for arc in records}
    except (ValueError, TypeError, KeyError) as error:
        raise RecordingError(
            f"{recording}: {EVENTS_TOPIC} and {TRAJECTORIES_TOPIC} do not hold what a simulation "
            f"writes there: {error!r}. Record it again."
        ) from error
    return RecordedTruth(failures, stamps, success.reshape(len(stamps), -1), step_s)


def scenario_text(scenario: Settings, robot: Settings, seed: int, habits: str | None = None) -> str:
    """The message that says which scenario, robot, seed and habits a recording is of."""
    parts = {"scenario": scenario, "robot": robot}
    content = {name: part.model_dump(mode="json") for name, part in parts.items()}
    named = {} if habits is None else {"habits": habits}
    return json.dumps(content | {"seed": seed} | named)


def read_scenario_text(recording: Path) -> str | None:
    """What ``scenario_text`` wrote into a recording; None where it holds no such message.

    Raises:
        RecordingError: The recording cannot be read.
    """
    return next(iter(_texts(recording, SCENARIO_TOPIC)), None)


def read_world(recording: Path) -> str:
    """The scenario and the seed of a simulated recording, which decide its layout; else empty.

    Two recordings of one world are not apart, be they driven otherwise.

    Raises:
        RecordingError: The recording cannot be read.
    """
    try:
        content = json.loads(read_scenario_text(recording) or "")
        return f"{content['scenario']['name']}, seed {content['seed']}"
    except (ValueError, TypeError, KeyError, AttributeError):
        # A topic of this name that no simulation of ours wrote.
        return ""


def truth_path(recording: Path) -> Path:
    """Where the true failures of a recording lie: beside it, and never read as its labels."""
    return recording.with_name(f"{recording.name}.truth.yaml")


def write_truth_annotation(recording: Path, truth: RecordedTruth, time_zero_ns: int) -> None:
    """Write the true failures in the format of labels files."""
    annotation = Annotation(
        recording=recording.name,
        sha256=recording_digest(recording),
        time_zero_ns=time_zero_ns,
        reviewer="simulation",
        intervals=tuple(_interval(event, time_zero_ns) for event in truth.events),
    )
    content = annotation.model_dump(mode="json", exclude_defaults=True)
    text = HEADING + yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=100)
    write_atomically(truth_path(recording), [text.encode()], RecordingError)


def _interval(event: Event, time_zero_ns: int) -> Interval:
    return Interval(
        start_s=(event.start_ns - time_zero_ns) / 1e9,
        stop_s=(event.stop_ns - time_zero_ns) / 1e9,
        kind=event.kind,
        verdict="added",
        note=event.evidence,
    )


def _texts(path: Path, topic: str) -> list[str]:
    """The texts on a topic; none where the recording has no such topic."""
    with open_recording(path) as recording:
        if topic not in recording.topics:
            return []
        decoded: list[Any] = [recording.decode(raw) for raw in recording.messages([topic])]
        return [str(message.data) for message in decoded]
