"""The simulated field against real time, and where its time goes."""

from __future__ import annotations

import cProfile
import pstats
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.measurement import Measurement, render_table
from graspe_data.progress import Silent
from graspe_data.robot import Robot
from graspe_data.simulation.recording import record_scenario
from graspe_data.simulation.scenario import Scenario, load_scenario
from pipelines.executors import Workers
from pipelines.simulate import Simulation, simulate

Stats = dict[tuple[str, int, str], tuple[float, ...]]

NAME = "meadow"
SHOW = {
    "camera": {"width": 640, "height": 480, "rate": 10.0},
    "lidar": {"rate": 10.0},
}
INSIDE = (
    ("world built", "build_world.py", "build_world"),
    ("drive", "drive_robot.py", "drive_robot"),
    ("camera", "camera.py", "picture"),
    ("JPEG", "jpeg.py", "encode_jpeg"),
    ("lidar", "lidar.py", "turn"),
    ("rays to surfaces (Embree), of both", "ray_scene.py", "cast"),
    ("shadow rays (Embree)", "ray_scene.py", "blocked"),
    ("messages written", "writing.py", "write"),
)


def run(quick: bool = False) -> list[Measurement]:
    """Record a meadow in the training size and in the size for show, then profile the first."""
    scenario, robot = load_scenario(NAME)
    training = _lasting(scenario, 10.0 if quick else 40.0)
    show = _for_show(_lasting(scenario, 5.0 if quick else 15.0))
    measured = [
        _two_workers("two recordings at a time, 320x240 and lidar at 5 Hz", training, robot, 1.0),
        _one("one recording, 320x240 and lidar at 5 Hz", training, robot),
        _one("one recording, 640x480 and lidar at 10 Hz", show, robot),
    ]
    return measured + _profile(training, robot)


def _lasting(scenario: Scenario, duration_s: float) -> Scenario:
    return scenario.model_copy(update={"duration_s": duration_s})


def _for_show(scenario: Scenario) -> Scenario:
    sensors = {
        name: getattr(scenario, name).model_copy(update=change) for name, change in SHOW.items()
    }
    return scenario.model_copy(update=sensors)


def _two_workers(name: str, scenario: Scenario, robot: Robot, target: float) -> Measurement:
    with tempfile.TemporaryDirectory() as folder:
        simulations = [Simulation(scenario, robot, seed, "mcap") for seed in (0, 1)]
        begin = time.perf_counter()
        simulate(simulations, Path(folder), Workers(2), Silent())
        wall = time.perf_counter() - begin
    note = "whole recordings, start of the workers included"
    return Measurement(
        name, 2 * scenario.duration_s / wall, "s simulated / s", target=target, note=note
    )


def _one(name: str, scenario: Scenario, robot: Robot, target: float | None = None) -> Measurement:
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        record_scenario(scenario, robot, 0, Path(folder) / "recording", "mcap")
        wall = time.perf_counter() - begin
    note = "rays on both cores"
    return Measurement(
        name, scenario.duration_s / wall, "s simulated / s", target=target, note=note
    )


def _profile(scenario: Scenario, robot: Robot) -> list[Measurement]:
    """Time of one recording by function, under the profiler, as shares of the whole."""
    profile = cProfile.Profile()
    with tempfile.TemporaryDirectory() as folder:
        profile.enable()
        record_scenario(scenario, robot, 0, Path(folder) / "recording", "mcap")
        profile.disable()
    stats = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    whole = max(entry[3] for entry in stats.values())
    return [
        Measurement(f"share: {name}", 100 * _cumulative(stats, file, function) / whole, "%")
        for name, file, function in INSIDE
    ]


def _cumulative(
    stats: dict[tuple[str, int, str], tuple[float, ...]], file: str, name: str
) -> float:
    return sum(
        entry[3]
        for (path, _, function), entry in stats.items()
        if function == name and path.endswith(f"/{file}") and "graspe_data" in path
    )


if __name__ == "__main__":
    sys.stdout.write(render_table(run("--quick" in sys.argv)))
