"""Simulated recordings in a folder: kept, replaced, and made by several at once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from graspe_data.errors import ManifestError, RecordingError
from graspe_data.observation.labels import read_annotation
from graspe_data.progress import Silent
from graspe_data.recordings import recording_digest
from graspe_data.simulation.recorded_truth import truth_path
from graspe_data.simulation.scenario import load_scenario
from pipelines.executors import Workers
from pipelines.simulate import Simulation, simulate

SCENARIO: dict[str, Any] = {
    "name": "lawn",
    "duration_s": 1.0,
    "world": {"length": 8.0, "width": 8.0, "ground": {"amplitude": 0.0, "cell": 1.0}},
    "camera": {"width": 32, "height": 24, "rate": 2.0},
    "lidar": {"rate": 2.0, "sub_rays": 1},
}


def lawn(folder: Path, **changes: Any) -> Simulation:
    path = folder / "lawn.yaml"
    path.write_text(yaml.safe_dump(SCENARIO | changes))
    scenario, robot = load_scenario(path)
    return Simulation(scenario, robot, 0, "bag")


def test_a_damaged_recording_is_made_again_only_where_that_is_asked(tmp_path: Path) -> None:
    moment, out = [lawn(tmp_path)], tmp_path / "out"
    (made,) = simulate(moment, out, Workers(1), Silent())
    whole = made.path.read_bytes()
    made.path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RecordingError):
        simulate(moment, out, Workers(1), Silent())
    simulate(moment, out, Workers(1), Silent(), replace=True)
    assert made.path.read_bytes() == whole


def test_a_recording_in_another_container_or_of_another_robot_is_not_taken_for_it(
    tmp_path: Path,
) -> None:
    moment, out = lawn(tmp_path), tmp_path / "out"
    simulate([moment], out, Workers(1), Silent())
    wider = moment.robot.footprint.model_copy(update={"width": 0.6})
    other = moment.robot.model_copy(update={"footprint": wider})
    with pytest.raises(RecordingError, match="not of this scenario"):
        simulate([Simulation(moment.scenario, other, 0, "bag")], out, Workers(1), Silent())
    for container in ("mcap", "db3"):
        simulated = simulate(
            [Simulation(moment.scenario, moment.robot, 0, container)],
            tmp_path / "out2",
            Workers(1),
            Silent(),
            replace=True,
        )
        assert any(container in path.name for path in simulated[0].path.iterdir())


def test_two_that_record_the_same_at_once_leave_one_whole_recording(tmp_path: Path) -> None:
    lawn(tmp_path)
    words = ["simulate", str(tmp_path / "lawn.yaml"), "--out", str(tmp_path / "out")]
    run = [sys.executable, "-c", "from pipelines.command_line import main; main()", *words]
    both = [subprocess.Popen(run, stderr=subprocess.PIPE) for _ in range(2)]
    assert [process.wait(timeout=120) for process in both] == [0, 0]
    path = tmp_path / "out" / "lawn-0.bag"
    read_annotation(truth_path(path), recording_digest(path))
    assert sorted(found.name for found in path.parent.iterdir()) == [
        "lawn-0.bag",
        "lawn-0.bag.truth.yaml",
    ]


def test_a_robot_is_not_born_inside_a_thing(tmp_path: Path) -> None:
    pillar = {"kind": "pillar", "at": [[0.8, 0.0]], "radius": [0.5, 0.5]}
    world = SCENARIO["world"] | {"features": [pillar], "start_clearance": 0.0}
    with pytest.raises(ManifestError, match=r"world\.start: .* born .* deep in the pillar"):
        simulate([lawn(tmp_path, world=world)], tmp_path / "out", Workers(1), Silent())
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"camera": {"rate": 1e-20}}, r"camera\.rate"),
        ({"lidar": {"rate": 0.01}}, r"lidar\.rate: 0\.01 Hz may give no cloud in 1 s"),
        ({"camera": {"mounting": {"translation": [1e300, 0, 0]}}}, "more than 10 m from base_link"),
        ({"planner": {"turn_rate": [1e-9, 1e-9]}}, r"planner\.turn_rate"),
        ({"planner": {"outlook_s": 1000}}, r"planner\.outlook_s"),
        (
            {"world": SCENARIO["world"] | {"materials": {"grass": {"strength": 5}}}},
            r"materials\.grass\.strength: .* at most 1; found 5",
        ),
        (
            {"occlusions": [{"kind": "lidar", "width": [1e-17, 1e-17], "every_s": [1, 1]}]},
            r"occlusions",
        ),
    ],
)
def test_what_no_simulation_can_do_is_refused(
    changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ManifestError, match=message):
        lawn(tmp_path, **changes)


def test_a_ground_of_too_many_triangles_is_refused_before_it_is_made(tmp_path: Path) -> None:
    world = {"length": 200, "width": 200, "ground": {"cell": 0.1, "amplitude": 0.0}}
    with pytest.raises(ManifestError, match="ground: this world would have"):
        simulate([lawn(tmp_path, world=world)], tmp_path / "out", Workers(1), Silent())
