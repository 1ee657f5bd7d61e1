"""What a recording holds, how well its topics run, and whether it can make rows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from graspe_data.inspection.evidence import gather_evidence
from graspe_data.inspection.known_robots import suggested_robots
from graspe_data.inspection.pairing import Pairing, pair_topics
from graspe_data.inspection.roles import Role
from graspe_data.inspection.several_robots import robot_namespaces, same_robot
from graspe_data.inspection.survey import Survey, TopicSurvey, survey_recording
from graspe_data.inspection.topic_choice import NEEDED, odometry_edges
from graspe_data.inspection.topic_content import Content
from graspe_data.inspection.topic_statistics import TopicStatistics, topic_statistics
from graspe_data.inspection.verdict import Verdict, verdict_of
from graspe_data.recordings.messages import Damage
from graspe_data.recordings.recording import Format, open_recording
from graspe_data.robot import Robot
from graspe_data.synchronisation.tracks import StampTrack


@dataclass(frozen=True)
class TopicReport:
    """A topic: ``serves`` lists its roles, ``fault`` is the first of ``undecodable`` messages."""

    name: str
    message_type: str
    serves: tuple[Role, ...]
    count: int
    frame: str
    undecodable: int
    fault: str | None
    content: Content | None
    time: TopicStatistics | None


@dataclass(frozen=True)
class Inspection:
    """The result of looking at a recording once.

    ``start_ns`` and ``end_ns`` are the first and last bag time, None without messages.
    """

    path: Path
    format: Format
    files: tuple[str, ...]
    messages: int
    start_ns: int | None
    end_ns: int | None
    topics: tuple[TopicReport, ...]
    pairings: tuple[Pairing, ...]
    losses: tuple[Damage, ...]
    verdict: Verdict
    suggested: tuple[tuple[str, float], ...] = ()
    """Robot manifests that ship and fit, the best first, and the share of their topics found."""
    notes: tuple[str, ...] = ()
    """What was decided on reading and costs no message: `Recording.notes`."""

    @property
    def duration_s(self) -> float:
        """Seconds of bag time from the first message to the last."""
        return ((self.end_ns or 0) - (self.start_ns or 0)) / 1e9

    def to_json(self) -> dict[str, Any]:
        """Plain values, ready for ``json.dumps``."""
        plain: dict[str, Any] = TypeAdapter(Inspection).dump_python(self, mode="json")
        return plain


def inspect_recording(path: Path, robot: Robot | None = None) -> Inspection:
    """Look at a recording in two passes; memory grows by some tens of bytes a message.

    The second pass is the first one of a build: the verdict is the word of the planner of rows.

    Args:
        path: Any recording that `open_recording` takes.
        robot: Its manifest, by whose topics and clocks the verdict is given; None guesses.

    Raises:
        RecordingError: Nothing of the recording can be read.
    """
    with open_recording(path) as recording:
        survey = survey_recording(recording)
        verdict = verdict_of(gather_evidence(recording, survey, robot))
        files, form = tuple(file.name for file in recording.files), recording.format
        notes = recording.notes
    times = [t.stamps.bag_ns for t in survey.topics.values() if t.count]
    start = min((int(stamps.min()) for stamps in times), default=None)
    return Inspection(
        path=path,
        format=form,
        files=files,
        messages=sum(topic.count for topic in survey.topics.values()),
        start_ns=start,
        end_ns=max((int(stamps.max()) for stamps in times), default=None),
        topics=tuple(_report(topic, start or 0) for topic in survey.topics.values()),
        pairings=_pairings(survey),
        losses=survey.losses,
        verdict=verdict,
        suggested=() if robot else suggested_robots(survey),
        notes=notes,
    )


def _report(topic: TopicSurvey, start_ns: int) -> TopicReport:
    return TopicReport(
        name=topic.info.name,
        message_type=topic.info.message_type,
        serves=topic.roles,
        count=topic.count,
        frame=topic.frame,
        undecodable=topic.undecodable,
        fault=topic.fault,
        content=topic.content,
        time=topic_statistics(topic.stamps, start_ns),
    )


def _pairings(survey: Survey) -> tuple[Pairing, ...]:
    """Every sensor with every odometry of its robot; with tf only where there is no other."""
    roles: tuple[Role, ...] = ("image", "points", "scan")
    sensors = [topic.stamps for role in roles for topic in survey.serving(role).values()]
    odometry: list[StampTrack] = [t.stamps for t in survey.serving("odometry").values()]
    odometry = odometry or list(odometry_edges(survey).values())
    spaces = robot_namespaces({role: set(survey.serving(role)) for role in NEEDED})
    return tuple(
        pair_topics(sensor, other)
        for sensor in sensors
        for other in odometry
        if same_robot(sensor.topic, other.topic, spaces)
    )
