"""How many labels of the simulated field are wrong, by what the robot does when it goes on?

The driven trajectory of a row is labelled by the rules, its candidates by the world's geometry.
Both are held against the simulator's mechanics: the rules against the events of the drive, every
candidate against a robot that is put where the picture was taken and keeps that command, with
slip, and stumbles over rocks that it comes to. No picture is rendered.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.label_rules import RULES, measured_motion
from benchmarks.publish import publish
from graspe_data.arrays import Mask
from graspe_data.observation.labels import Decided, LabelSettings, decide, label_rows, propose
from graspe_data.observation.labels.events import bounds_ns, touches
from graspe_data.robot import Robot
from graspe_data.simulation.field import part_generator, scenario_world
from graspe_data.simulation.motion.drive import STEP_S, Drive
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from graspe_data.simulation.motion.drive_robot import drive_robot
from graspe_data.simulation.motion.footprint import clearance
from graspe_data.simulation.motion.mechanics import STUMBLES
from graspe_data.simulation.motion.random_planner import RandomPlanner
from graspe_data.simulation.recording import ARC_STEP_S, ARC_STEPS, draw_candidates
from graspe_data.simulation.scenario import Scenario, load_scenario
from graspe_data.simulation.truth.events import true_events
from graspe_data.simulation.truth.outlook import candidate_success
from graspe_data.simulation.world.world import World

WORLDS = ("meadow", "woodland", "thicket", "yard", "mixed", "dusk_woodland", "overgrown")
EVERY_S = 2.0
HELD_S = 1.2
"""Driven on after the arc's end, so that a robot caught there is seen to be held."""
AT_ONCE = {"linear_acceleration": 1e3, "yaw_acceleration": 1e3}

Pair = tuple[Mask, Mask]
HEADING = (
    "| label | steps | failing | wrong, of all steps | of those said to fail "
    "| of those said to succeed | trajectories said to fail in time, of those that do not "
    "| said not to, of those that do | AU-ROC of who knows it all |\n" + "| --- " * 9 + "|"
)


def main() -> int:
    """Compare in every world, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("worlds", nargs="*", default=WORLDS, help="scenarios that ship")
    parser.add_argument("--seeds", type=int, nargs=2, default=(0, 1), help="first and last")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    seeds = range(arguments.seeds[0], arguments.seeds[1] + 1)
    tasks = [(name, seed) for name in arguments.worlds for seed in seeds]
    with ProcessPoolExecutor(arguments.workers) as pool:
        pairs = list(pool.map(both, *zip(*tasks, strict=True)))
    driven, candidates = zip(*pairs, strict=True)
    lines = [HEADING, row("driven, by the rules", driven)]
    lines.append(row("candidates, by the world", candidates))
    for name in arguments.worlds:
        part = [pair for pair, (world, _) in zip(candidates, tasks, strict=True) if world == name]
        lines.append(row(f"candidates in {name}", part))
    publish(lines, arguments.out)
    return 0


def both(name: str, seed: int) -> tuple[Pair, Pair]:
    """What labels say and what happens, of the rows of one drive and of their candidates.

    Each bool (P, T), 1 = success. Of a driven row only the judged steps, so T = 1.
    """
    scenario, robot = load_scenario(name)
    world = scenario_world(scenario, seed)
    planner = RandomPlanner(
        world, robot, scenario.planner, part_generator(scenario, seed, "planner")
    )
    motion = part_generator(scenario, seed, "motion")
    driven = drive_robot(world, robot, planner, scenario.motion, scenario.duration_s, motion)
    moments = np.arange(0, len(driven.time_s), round(EVERY_S / STEP_S))
    free = ~touches(*bounds_ns(true_events(driven)), *instants(driven, moments))
    sys.stderr.write(f"{name} {seed}: {len(moments)} rows, failing already in {(~free).sum()}\n")
    return (
        driven_labels(scenario, seed, driven, moments),
        candidate_labels(scenario, robot, world, driven, moments[free], seed),
    )


def instants(drive: Drive, moments: NDArray[np.intp]) -> tuple[NDArray[np.int64], ...]:
    """The nanosecond that ends at each of these steps."""
    stamps = np.rint(drive.time_s[moments] * 1e9).astype(np.int64)
    return stamps - 1, stamps


def driven_labels(scenario: Scenario, seed: int, drive: Drive, moments: NDArray[np.intp]) -> Pair:
    """Rows labelled by what the rules propose, and by what truly befell the robot."""
    series = measured_motion(drive, scenario, part_generator(scenario, seed, "imu"))
    _, stamps = instants(drive, moments)
    by_rule = decide(propose(series, RULES), None, "take")
    truly = Decided(taken=tuple(true_events(drive)))
    label, truth = (
        label_rows(stamps, series.odometry, decided, LabelSettings())
        for decided in (by_rule, truly)
    )
    mask = label.mask & truth.mask
    return label.success.astype(bool)[mask][:, None], truth.success.astype(bool)[mask][:, None]


def candidate_labels(
    scenario: Scenario,
    robot: Robot,
    world: World,
    drive: Drive,
    moments: NDArray[np.intp],
    seed: int,
) -> Pair:
    """Candidates labelled as recordings are, and driven."""
    generator = part_generator(scenario, seed, "candidates")
    velocities = draw_candidates(robot.limits, len(moments), generator)
    mechanics = scenario.motion.mechanics
    labels = candidate_success(
        world, robot, drive, moments, velocities, ARC_STEPS, ARC_STEP_S, mechanics
    )
    poses = np.column_stack([drive.position[moments, :2], drive.attitude[moments, 2]])
    outcomes = [
        goes_on(scenario, robot, begun(world, robot, pose), velocity, generator)
        for pose, arcs in zip(poses.tolist(), velocities, strict=True)
        for velocity in arcs.tolist()
    ]
    return labels.reshape(-1, ARC_STEPS), np.array(outcomes)


def begun(world: World, robot: Robot, pose: Sequence[float]) -> World:
    """The world with the robot at a pose, without the rocks that it stands on there."""
    obstacles = world.obstacles
    gaps = clearance(robot.footprint, np.array([pose]), obstacles)[0]
    met = (obstacles.effect == STUMBLES) & (gaps < 0)
    x, y, yaw = pose
    return replace(world, start=(x, y, yaw), obstacles=obstacles.at(np.flatnonzero(~met)))


def goes_on(
    scenario: Scenario,
    robot: Robot,
    world: World,
    velocity: Sequence[float],
    generator: np.random.Generator,
) -> Mask:
    """Whether a robot at the world's start that keeps its velocity succeeds in each step, (T,)."""
    quick = robot.model_copy(update={"limits": robot.limits.model_copy(update=AT_ONCE)})
    lasting = ARC_STEPS * ARC_STEP_S + HELD_S
    drive = DriveInProgress(world, quick, scenario.motion, lasting, generator)
    drive.advance((velocity[0], velocity[1]), round(lasting / STEP_S))
    edges = np.rint(np.arange(ARC_STEPS + 1) * ARC_STEP_S * 1e9).astype(np.int64)[None]
    failed = touches(*bounds_ns(true_events(drive.drive())), edges[:, :-1], edges[:, 1:])
    succeeds: Mask = ~np.logical_or.accumulate(failed[0])
    return succeeds


def row(name: str, pairs: Sequence[Pair]) -> str:
    """A line of the table."""
    labels, truth = (np.concatenate(side) for side in zip(*pairs, strict=True))
    wrong, ends, truly = labels != truth, labels[:, -1], truth[:, -1]
    shares = (
        (~truth).mean(),
        wrong.mean(),
        wrong[~labels].mean(),
        wrong[labels].mean(),
        (~ends)[truly].mean(),
        ends[~truly].mean(),
    )
    cells = " | ".join(f"{100 * share:.2f} %" for share in shares)
    # Scores of 0 and 1: the mean of the shares of successes and of failures that are said so.
    area = (truth[labels].mean() + (~truth)[~labels].mean()) / 2
    return f"| {name} | {labels.size} | {cells} | {area:.3f} |"


if __name__ == "__main__":
    sys.exit(main())
