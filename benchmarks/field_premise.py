"""The premise of GrASPE in the simulated field: reliability against structure, grass and light."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.observation.image_reliability import ImageReliabilitySettings, image_reliability
from graspe_data.observation.observe import observe_points
from graspe_data.observation.point_reliability import PointReliabilitySettings, point_reliability
from graspe_data.observation.settings import PointObservationSettings
from graspe_data.sensor_data import PointCloud
from graspe_data.simulation.camera.lens_cover import LensCover
from graspe_data.simulation.scenario import Scenario, load_scenario
from graspe_data.simulation.simulated_drive import SimulatedDrive, simulate_drive
from graspe_data.simulation.world.obstacles import Obstacles

STRUCTURED = ("yard", "intensity_1_glass", "intensity_2_curtain")
GRASSY = ("meadow", "graspe_3_tall_grass", "intensity_4_intertwined")
OTHERS = ("woodland", "thicket", "graspe_1_plants", "graspe_2_hanging_leaves")
BY_DAY: dict[str, object] = {"illuminance_lux": (40_000.0, 40_000.0)}
EVERY_S = 3.0
FIRST_SEED = 500


@dataclass(frozen=True)
class Condition:
    """What is done to the camera: settings of light and camera, and the share of lens covered."""

    name: str
    light: dict[str, object]
    camera: dict[str, object]
    cover: float = 0.0


CONDITIONS = (
    Condition("day", BY_DAY, {}),
    Condition("dusk, 20 lux", {"illuminance_lux": (20.0, 20.0), "sky": "overcast"}, {}),
    Condition("night, 2 lux", {"illuminance_lux": (2.0, 2.0), "sky": "overcast"}, {}),
    Condition(
        "blurred, shaken at 2 rad/s",
        BY_DAY | {"illuminance_lux": (150.0, 150.0)},
        {"exposure_limit": 0.033, "vibration": 2.0},
    ),
    Condition("lens covered by half", BY_DAY, {}, 0.5),
    Condition("lens covered to 80 %", BY_DAY, {}, 0.8),
    Condition("lens wholly covered", BY_DAY, {}, 1.0),
)


@dataclass(frozen=True)
class DriveMoment:
    """One moment of a drive: what the sensors saw and what it is worth."""

    picture: NDArray[np.uint8]
    points: NDArray[np.void]
    r_img: float
    r_point: float
    in_grass: bool


def moments(simulated: SimulatedDrive, cover: LensCover | None = None) -> Iterator[DriveMoment]:
    """Look at the world every three seconds of a drive."""
    generator = np.random.default_rng(simulated.seed)
    driven, grass = simulated.driven, simulated.world.obstacles.having("slows")
    for time_s in np.arange(EVERY_S, driven.time_s[-1] - 1.0, EVERY_S):
        step = int(np.searchsorted(driven.time_s, time_s))
        pose = driven.base_pose(float(time_s))
        speed = driven.velocity[step, 0]
        twist = (np.array([speed, 0.0, 0.0]), driven.gyro[step])
        picture = simulated.camera.picture(pose, twist, generator, cover)
        points = simulated.lidar.turn(float(time_s), driven.base_pose, generator)
        yield DriveMoment(
            picture,
            points,
            image_reliability(picture, ImageReliabilitySettings()).r_img,
            r_point(points, simulated),
            _inside(driven.position[step, :2], grass),
        )


def r_point(points: NDArray[np.void], simulated: SimulatedDrive) -> float:
    """Equation (5) of a turn."""
    xyz = np.stack([points[axis] for axis in "xyz"], axis=1)
    cloud = PointCloud(0, "velodyne", xyz, points["intensity"], points["ring"].astype(np.int32))
    lidar = simulated.robot.lidar
    settings = PointObservationSettings(
        rings=lidar.rings,
        minimum_range=lidar.minimum_range,
        base_height=simulated.robot.base_height,
    )
    observed = observe_points(cloud, simulated.lidar.base_from_lidar, settings, seed=0)
    return point_reliability(observed.smoothness, PointReliabilitySettings()).r_point


def _inside(place: NDArray[np.float64], patches: Obstacles) -> bool:
    along = patches.end - patches.start
    length = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip(((place - patches.start) * along).sum(axis=1) / length, 0.0, 1.0)
    nearest = patches.start + share[:, None] * along
    return bool((np.linalg.norm(place - nearest, axis=1) < patches.radius).any())


def _drives(name: str, count: int, duration_s: float) -> Iterator[SimulatedDrive]:
    scenario, robot = load_scenario(name)
    for seed in range(FIRST_SEED, FIRST_SEED + count):
        yield simulate_drive(scenario.model_copy(update={"duration_s": duration_s}), robot, seed)


def changed(scenario: Scenario, condition: Condition, duration_s: float) -> Scenario:
    """The scenario under a condition of the camera."""
    light = scenario.light.model_copy(update=condition.light)
    camera = scenario.camera.model_copy(update=condition.camera)
    return scenario.model_copy(update={"light": light, "camera": camera, "duration_s": duration_s})


def by_structure(drives: int, duration_s: float) -> dict[str, dict[str, list[float]]]:
    """r_point of every moment, by kind of scene and scenario."""
    found: dict[str, dict[str, list[float]]] = {"structured": {}, "in tall grass": {}, "other": {}}
    for name in (*STRUCTURED, *GRASSY, *OTHERS):
        for simulated in _drives(name, drives, duration_s):
            for moment in moments(simulated):
                kind = "in tall grass" if moment.in_grass else "other"
                kind = "structured" if name in STRUCTURED and not moment.in_grass else kind
                found[kind].setdefault(name, []).append(moment.r_point)
    return found


def by_condition(drives: int, duration_s: float) -> dict[str, list[float]]:
    """r_img of the same drives through the same worlds under each condition."""
    found: dict[str, list[float]] = {}
    scenario, robot = load_scenario("meadow")
    for condition in CONDITIONS:
        altered = changed(scenario, condition, duration_s)
        for seed in range(FIRST_SEED, FIRST_SEED + drives):
            cover = LensCover(condition.cover, seed) if condition.cover else None
            seen = moments(simulate_drive(altered, robot, seed), cover)
            found.setdefault(condition.name, []).extend(moment.r_img for moment in seen)
    return found


def render(structure: dict[str, dict[str, list[float]]], conditions: dict[str, list[float]]) -> str:
    """Two Markdown tables."""
    lines = ["| r_point | moments | median | 10 % to 90 % |", "| --- | --- | --- | --- |"]
    for kind, scenarios in structure.items():
        together = [value for values in scenarios.values() for value in values]
        lines.append(_line(f"**{kind}**", together))
        lines += [_line(name, values) for name, values in scenarios.items()]
    lines += ["", "| r_img | moments | median | 10 % to 90 % |", "| --- | --- | --- | --- |"]
    lines += [_line(name, values) for name, values in conditions.items()]
    return "\n".join(lines) + "\n"


def _line(name: str, values: list[float]) -> str:
    low, median, high = np.percentile(values, (10, 50, 90))
    return f"| {name} | {len(values)} | {median:.2f} | {low:.2f} to {high:.2f} |"


def main() -> None:
    """Measure and write ``field_premise.md`` into a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--drives", type=int, default=3, help="worlds of each scenario")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each drive")
    arguments = parser.parse_args()
    structure = by_structure(arguments.drives, arguments.seconds)
    conditions = by_condition(arguments.drives, arguments.seconds)
    arguments.out.mkdir(parents=True, exist_ok=True)
    text = render(structure, conditions)
    (arguments.out / "field_premise.md").write_text(text)
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
