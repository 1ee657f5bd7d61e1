"""What a simulated recording says of candidates, written and read back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.known_outcomes import KnownOutcomes, read_outcomes
from graspe_data.manifest import find_manifest, load_manifest
from graspe_data.recordings.writing import RecordingWriter
from graspe_data.robot import Robot
from graspe_data.simulation.messages import Messages

TOPIC = "/truth/candidates"
SAID = {
    "stamp_ns": 5,
    "step_s": 0.3,
    "velocities": [[0.4, -0.1], [0.5, 0.2]],
    "success": [[1, 0, 0], [1, 1, 1]],
}


def recorded(folder: Path, texts: list[str]) -> Path:
    robot = load_manifest(find_manifest("robots", "spot"), Robot)
    path = folder / "told.bag"
    with RecordingWriter(path, "bag", "none") as writer:
        for number, text in enumerate(texts):
            writer.write(TOPIC, Messages(robot).text(text), 10 + number)
    return path


def test_outcomes_come_back_as_they_were_told(tmp_path: Path) -> None:
    draw = np.random.default_rng(0)
    told = KnownOutcomes(
        np.array([3, 8, 2**62]),
        draw.normal(size=(3, 4, 2)),
        draw.random((3, 4, 10)) < 0.5,
        0.3,
    )
    found = read_outcomes(recorded(tmp_path, list(told.texts())), TOPIC)
    np.testing.assert_array_equal(found.stamps_ns, told.stamps_ns)
    np.testing.assert_array_equal(found.velocities, told.velocities)
    np.testing.assert_array_equal(found.success, told.success)
    assert found.step_s == 0.3


def test_a_recording_without_the_topic_says_what_to_do(tmp_path: Path) -> None:
    path = recorded(tmp_path, [json.dumps(SAID)])
    with pytest.raises(RecordingError, match=r"no topic /other.*graspe simulate.*Leave"):
        read_outcomes(path, "/other")


@pytest.mark.parametrize(
    "change",
    [
        {"velocities": [0.4, 0.5]},
        {"velocities": [[0.4, float("nan")], [0.5, 0.2]]},
        {"velocities": [["a", 0.1], [0.5, 0.2]]},
        {"success": [[1, 0, 0]]},
        {"success": [1, 1]},
        {"step_s": None},
        {"stamp_ns": "now"},
    ],
)
def test_what_no_simulation_writes_is_refused(change: dict[str, Any], tmp_path: Path) -> None:
    path = recorded(tmp_path, [json.dumps(SAID | change)])
    with pytest.raises(RecordingError, match="does not hold what a simulation writes"):
        read_outcomes(path, TOPIC)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", '{"stamp_ns": 1}'])
def test_texts_that_are_something_else_are_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="does not hold what a simulation writes"):
        read_outcomes(recorded(tmp_path, [text]), TOPIC)


def test_moments_of_different_steps_are_refused(tmp_path: Path) -> None:
    texts = [json.dumps(SAID), json.dumps(SAID | {"step_s": 0.5})]
    with pytest.raises(RecordingError, match="does not hold what a simulation writes"):
        read_outcomes(recorded(tmp_path, texts), TOPIC)
