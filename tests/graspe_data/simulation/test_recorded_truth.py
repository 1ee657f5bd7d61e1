"""The truth of a recording, written on its topics and read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.observation.labels import Event, annotation_path, read_annotation
from graspe_data.recordings import RecordingWriter, recording_digest
from graspe_data.recordings.writing import Container
from graspe_data.robot import Robot
from graspe_data.simulation.messages import Messages
from graspe_data.simulation.recorded_truth import (
    EVENTS_TOPIC,
    SCENARIO_TOPIC,
    TRAJECTORIES_TOPIC,
    RecordedTruth,
    read_scenario_text,
    read_truth,
    truth_path,
    write_truth_annotation,
)

ZERO = 1_700_000_000_000_000_000
TRUTH = RecordedTruth(
    events=(
        Event("collision", ZERO + 1_230_000_000, ZERO + 1_560_000_000, "tree"),
        Event("stuck", ZERO + 1_560_000_000, ZERO + 4_000_000_000, "blocked"),
    ),
    stamps_ns=ZERO + np.arange(4) * 200_000_000,
    success=np.array([[1, 1, 1], [1, 1, 0], [1, 0, 0], [0, 0, 0]], np.bool_),
    step_s=0.3,
)


def write(path: Path, texts: dict[str, list[str]], container: Container = "mcap") -> Path:
    text = Messages(load_manifest(find_manifest("robots", "spot"), Robot)).text
    with RecordingWriter(path, container) as writer:
        for topic, contents in texts.items():
            for content in contents:
                writer.write(topic, text(content), ZERO)
    return path


def topics(truth: RecordedTruth) -> dict[str, list[str]]:
    return {
        SCENARIO_TOPIC: ['{"seed": 3}'],
        TRAJECTORIES_TOPIC: list(truth.trajectory_texts()),
        EVENTS_TOPIC: [truth.events_text()],
    }


@pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
def test_the_truth_comes_back_as_it_was(container: Container, tmp_path: Path) -> None:
    path = write(tmp_path / "drive.bag", topics(TRUTH), container)
    again = read_truth(path)
    assert again.events == TRUTH.events
    assert again.step_s == TRUTH.step_s
    np.testing.assert_array_equal(again.stamps_ns, TRUTH.stamps_ns)
    np.testing.assert_array_equal(again.success, TRUTH.success)
    assert read_scenario_text(path) == '{"seed": 3}'


def test_a_drive_without_failures_says_so(tmp_path: Path) -> None:
    free = RecordedTruth((), TRUTH.stamps_ns, TRUTH.success, 0.3)
    assert read_truth(write(tmp_path / "free", topics(free))).events == ()


def test_a_recording_of_something_else_has_no_truth(tmp_path: Path) -> None:
    path = write(tmp_path / "other", {"/chatter": ["hello"]})
    assert read_scenario_text(path) is None
    with pytest.raises(RecordingError, match="so its truth is not known"):
        read_truth(path)


@pytest.mark.parametrize("said", ["no JSON", '{"stamp_ns": 1}', "[]", '"text"'])
def test_truth_that_is_none_is_refused(said: str, tmp_path: Path) -> None:
    path = write(tmp_path / "odd", topics(TRUTH) | {TRAJECTORIES_TOPIC: [said]})
    with pytest.raises(RecordingError, match="do not hold what a simulation writes there"):
        read_truth(path)


def test_the_failures_lie_beside_as_a_person_would_state_them(tmp_path: Path) -> None:
    path = write(tmp_path / "drive", topics(TRUTH))
    write_truth_annotation(path, TRUTH, ZERO)
    stated = read_annotation(truth_path(path), recording_digest(path))
    assert tuple(stated.event(interval) for interval in stated.intervals) == TRUTH.events
    assert {interval.verdict for interval in stated.intervals} == {"added"}
    assert (stated.recording, stated.reviewer) == ("drive", "simulation")
    assert not annotation_path(path).exists()
