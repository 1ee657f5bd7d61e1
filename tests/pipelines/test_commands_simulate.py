"""``graspe simulate`` and ``graspe label score``: recordings with their truth, for the rules."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner, Result

from graspe_data.errors import ManifestError
from graspe_data.recordings import open_recording, recording_digest
from graspe_data.simulation.recorded_truth import truth_path
from pipelines.command_line import app

SCENARIO: dict[str, Any] = {
    "name": "yard",
    "duration_s": 2.0,
    "world": {
        "length": 12.0,
        "width": 10.0,
        "ground": {"amplitude": 0.0, "cell": 1.0},
        "features": [{"kind": "pillar", "at": [[3.0, 0.0], [-3.0, -2.0]]}],
    },
    "camera": {"width": 80, "height": 60, "rate": 2.0},
    "lidar": {"rate": 2.0, "sub_rays": 1},
}
DATASET = {
    "name": "small",
    "robot": "spot",
    "window": {"history_steps": 5},
    "horizon": {"steps": 2},
}


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "yard.yaml"
    path.write_text(yaml.safe_dump(SCENARIO))
    return path


def graspe(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def simulate(scenario: Path, out: Path, *more: object) -> Result:
    return graspe("simulate", scenario, "--out", out, *more)


def test_every_seed_makes_a_recording_with_its_truth_beside(scenario: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = simulate(scenario, out, "--recordings", 2, "--seed", 7, "--json")
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert [item["path"] for item in report] == [str(out / f"yard-{seed}.bag") for seed in (7, 8)]
    assert sorted(path.name for path in out.iterdir()) == sorted(
        f"yard-{seed}.bag{suffix}" for seed in (7, 8) for suffix in ("", ".truth.yaml")
    )
    assert recording_digest(out / "yard-7.bag") != recording_digest(out / "yard-8.bag")


@pytest.mark.parametrize(("container", "file"), [("db3", "yard-0.db3"), ("mcap", "yard-0.mcap")])
def test_ros_2_recordings_are_folders(
    container: str, file: str, scenario: Path, tmp_path: Path
) -> None:
    assert simulate(scenario, tmp_path / "out", "--format", container).exit_code == 0
    assert (tmp_path / "out" / "yard-0" / file).is_file()
    assert truth_path(tmp_path / "out" / "yard-0").is_file()


def test_a_robots_habits_have_a_recording_of_their_own(scenario: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert simulate(scenario, out).exit_code == 0
    result = simulate(scenario, out, "--habits", "spot_ros1", "--json")
    assert result.exit_code == 0, result.output
    (report,) = json.loads(result.stdout)
    path = out / "yard-0-spot_ros1.bag"
    assert report["path"] == str(path)
    assert truth_path(path).is_file()
    with open_recording(path) as recording:
        assert {"/spot/odometry", "/spot/lidar/points", "/tf"} <= recording.topics.keys()
        assert "/velodyne_points" not in recording.topics
    again = json.loads(simulate(scenario, out, "--habits", "spot_ros1", "--json").stdout)
    assert again[0]["wall_s"] is None


def test_habits_that_nobody_has_are_refused_before_anything_is_written(
    scenario: Path, tmp_path: Path
) -> None:
    result = simulate(scenario, tmp_path / "out", "--habits", "spot_ros")
    assert result.exit_code != 0
    assert isinstance(result.exception, ManifestError)
    assert "Did you mean 'spot_ros" in str(result.exception)


def test_the_number_of_workers_changes_no_byte(scenario: Path, tmp_path: Path) -> None:
    digests = []
    for workers in (1, 2):
        out = tmp_path / f"by-{workers}"
        assert simulate(scenario, out, "--recordings", 2, "--workers", workers).exit_code == 0
        digests.append([recording_digest(out / f"yard-{seed}.bag") for seed in (0, 1)])
    assert digests[0] == digests[1]


def test_what_is_there_stays_and_what_was_cut_off_is_made_again(
    scenario: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    simulate(scenario, out)
    kept, since = out / "yard-0.bag", (out / "yard-0.bag").stat().st_mtime_ns
    cut_off = out / ".yard-1.bag.0a1b2c3d.partial"
    cut_off.mkdir()
    (cut_off / "yard-1.bag").write_bytes(b"half")
    result = simulate(scenario, out, "--recordings", 2)
    assert result.exit_code == 0
    assert "was there" in result.stdout
    assert kept.stat().st_mtime_ns == since
    assert not cut_off.exists()
    assert (out / "yard-1.bag").is_file()


def test_a_recording_of_another_scenario_is_not_taken_for_this_one(
    scenario: Path, tmp_path: Path
) -> None:
    simulate(scenario, tmp_path / "out")
    result = simulate(scenario, tmp_path / "out", "--duration", 3)
    assert result.exit_code == 1
    assert "is not of this scenario as it stands now" in str(result.exception)


def test_a_world_that_cannot_be_is_named(scenario: Path, tmp_path: Path) -> None:
    inside = {"kind": "pillar", "at": [[0.2, 0.0]]}
    world = SCENARIO["world"] | {"features": [inside]}
    scenario.write_text(yaml.safe_dump(SCENARIO | {"world": world}))
    result = simulate(scenario, tmp_path / "out")
    assert result.exit_code == 1
    assert "pillar" in str(result.exception)
    assert not list((tmp_path / "out").iterdir())


def test_without_open3d_it_says_what_to_install(scenario: Path, tmp_path: Path) -> None:
    without = "import sys; sys.modules['open3d'] = None; from pipelines.command_line import main"
    result = subprocess.run(
        [sys.executable, "-c", f"{without}; main()", "simulate", scenario, "--out", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 1
    assert result.stderr == (
        "graspe: graspe simulate casts its rays with Open3D, which is not installed: "
        "pip install 'graspe[simulation]'.\n"
    )


def test_the_rules_are_scored_against_the_truth(scenario: Path, tmp_path: Path) -> None:
    simulate(scenario, tmp_path / "out", "--recordings", 2)
    rules = tmp_path / "rules.yaml"
    rules.write_text(yaml.safe_dump(DATASET))
    result = graspe("label", "score", tmp_path / "out", "--recipe", rules, "--json")
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert report["recordings"] == 2
    assert set(report["events"]) == {"stuck", "collision", "stumble"}
    assert report["steps"]["steps"] == report["steps"]["judged"] > 0
    assert report["steps"]["agreement"] == 1.0
    result = graspe("label", "score", tmp_path / "out", "--recipe", rules)
    assert "100.0 % agree with the truth" in " ".join(result.stdout.split())


def test_another_horizon_or_no_truth_is_refused(scenario: Path, tmp_path: Path) -> None:
    simulate(scenario, tmp_path / "out")
    rules = tmp_path / "rules.yaml"
    rules.write_text(yaml.safe_dump(DATASET | {"horizon": {"steps": 2, "step_s": 0.2}}))
    result = graspe("label", "score", tmp_path / "out", "--recipe", rules)
    assert result.exit_code == 3
    assert "the dataset's horizon has 2 of 0.2 s" in result.stderr


def test_another_rate_of_the_sensors_is_recorded_and_makes_rows(
    scenario: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    result = simulate(scenario, out, "--sensor-rate", 1, "--duration", 4)
    assert result.exit_code == 0, result.output
    report = json.loads(graspe("inspect", out / "yard-0.bag", "--json").stdout)
    assert "no image has a cloud" not in json.dumps(report)
    again = simulate(scenario, out, "--duration", 4)
    assert again.exit_code == 1
    wrong = simulate(scenario, tmp_path / "other", "--sensor-rate", 3)
    assert wrong.exit_code == 1
    assert "--sensor-rate 3" in str(wrong.exception)
