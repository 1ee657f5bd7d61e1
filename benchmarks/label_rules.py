"""The label rules against the truth of simulated drives, of which no picture is rendered."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from graspe_data.manifest import shipped_manifests
from graspe_data.observation.labels import (
    CommandSeries,
    EventKind,
    InertialSeries,
    MotionSeries,
    OdometrySeries,
    ProposalSettings,
    propose,
)
from graspe_data.robot import Robot
from graspe_data.simulation.field import part_generator, scenario_world
from graspe_data.simulation.message_stream import IMU_NOISE
from graspe_data.simulation.motion.drive import STEP_S, Drive
from graspe_data.simulation.motion.drive_robot import drive_robot
from graspe_data.simulation.motion.random_planner import RandomPlanner
from graspe_data.simulation.scenario import Scenario, load_scenario
from graspe_data.simulation.truth.events import true_events
from pipelines.label_scores import KINDS
from pipelines.score_counts import EventScore, score_events

# Oscillation is the planner's failure, of which the world knows nothing.
RULES = ProposalSettings(oscillation=None)
Scores = dict[EventKind, EventScore]


def main() -> int:
    """Drive every scenario with every seed, score the rules, and store the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs=2, default=(200, 204), help="first and last")
    parser.add_argument("--caution", type=float, help="of the planner, instead of the scenario's")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/label_rules.md"))
    arguments = parser.parse_args()
    seeds, rows = range(arguments.seeds[0], arguments.seeds[1] + 1), dict[str, Scores]()
    for path in sorted((shipped_manifests() / "scenarios").glob("*.yaml")):
        sys.stderr.write(f"{path.stem} ...\n")
        scenario, robot = load_scenario(path)
        changes = {} if arguments.caution is None else {"caution": arguments.caution}
        planner = scenario.planner.model_copy(update=changes)
        scenario = scenario.model_copy(update={"planner": planner})
        rows[path.stem] = sum_of([score(scenario, robot, seed) for seed in seeds])
    rows["**all**"] = sum_of(list(rows.values()))
    caution = "the scenario's" if arguments.caution is None else f"{arguments.caution:g}"
    table = (
        f"Seeds {seeds[0]} to {seeds[-1]}; the planner's caution is {caution}.\n\n{render(rows)}"
    )
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(table)
    sys.stdout.write(table)
    return 0


def score(scenario: Scenario, robot: Robot, seed: int) -> Scores:
    """One drive, the same as in the recording of that scenario and seed."""
    world = scenario_world(scenario, seed)
    draw = part_generator(scenario, seed, "planner")
    planner = RandomPlanner(world, robot, scenario.planner, draw)
    motion = part_generator(scenario, seed, "motion")
    driven = drive_robot(world, robot, planner, scenario.motion, scenario.duration_s, motion)
    series = measured_motion(driven, scenario, part_generator(scenario, seed, "imu"))
    proposed, true = propose(series, RULES).events, true_events(driven)
    return {kind: score_events(proposed, true, kind) for kind in KINDS}


def measured_motion(driven: Drive, scenario: Scenario, noise: np.random.Generator) -> MotionSeries:
    """What the robot itself reports, at the scenario's rates and with the IMU's noise."""
    stamps = np.round(driven.time_s * 1e9).astype(np.int64)
    odometry, command, imu = (
        slice(None, None, round(1 / rate / STEP_S))
        for rate in (scenario.rates.odometry, scenario.rates.command, scenario.rates.imu)
    )
    inertial = np.concatenate([driven.acceleration, driven.gyro], axis=1)[imu]
    inertial = inertial + noise.normal(0.0, np.repeat(IMU_NOISE, 3), inertial.shape)
    x, y, yaw = driven.odometry[odometry].T
    v, omega = driven.measured[odometry].T
    roll, pitch, _ = driven.attitude[odometry].T
    return MotionSeries(
        OdometrySeries(stamps[odometry], x, y, yaw, v, omega, roll, pitch),
        CommandSeries(stamps[command], *driven.command[command].T),
        InertialSeries(stamps[imu], inertial[:, 3:], inertial[:, :3]),
    )


def sum_of(scores: Sequence[Scores]) -> Scores:
    """Several together."""
    return {kind: sum((item[kind] for item in scores), EventScore()) for kind in KINDS}


def render(rows: dict[str, Scores]) -> str:
    """A Markdown table."""
    heads = [f"{kind}: true | recall | precision" for kind in KINDS]
    lines = [f"| scenario | {' | '.join(heads)} |", "| --- " * (1 + 3 * len(KINDS)) + "|"]
    for name, scores in rows.items():
        cells = [
            f"{scores[kind].true} | {share(scores[kind].recall)} | {share(scores[kind].precision)}"
            for kind in KINDS
        ]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def share(value: float | None) -> str:
    """A share, or a dash where there was nothing to share."""
    return "-" if value is None else f"{value:.3f}"


if __name__ == "__main__":
    sys.exit(main())
