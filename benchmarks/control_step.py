"""How long a whole control step takes: raw picture and cloud in, a command out.

Each step has a new picture and a new cloud, as a robot's drivers hand them on: reliabilities,
points and history are computed, the scene is encoded, all candidates are drawn and scored, one is
chosen.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.publish import publish
from graspe_data.simulation.field import Field, build_field, part_generator
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from graspe_data.simulation.scenario import load_scenario
from pipelines.trials.config import TrialConfig
from pipelines.trials.methods import Method, make_planner
from pipelines.trials.run_trial import trial_scenario
from pipelines.trials.situations import Senses, Situations
from planners.bundle import load_bundle
from planners.situation import Planner, Situation

BETWEEN_STEPS = 20
FIRST_STEPS = 60
SPEED = 0.4


def main() -> int:
    """Measure every bundle given on the same situations, one after another."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bundles", type=Path, nargs="+")
    parser.add_argument("--scenario", default="graspe_1_plants")
    parser.add_argument("--steps", type=int, default=30)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    scenario, robot = load_scenario(arguments.scenario)
    config = TrialConfig()
    field = build_field(trial_scenario(scenario, config.trial), robot, 1, front_only=True)
    moments = list(situations(field, config, arguments.steps))
    lines = [HEADING]
    for path in arguments.bundles:
        planner = make_planner(Method(path.name, path), field, config, arguments.threads)
        contract = load_bundle(path).contract
        lines.append(_line(f"{contract.model}, {contract.preset}", planner, moments))
        sys.stderr.write(lines[-1] + "\n")
    publish(lines, arguments.out)
    return 0


def situations(field: Field, config: TrialConfig, number: int) -> Iterator[Situation]:
    """What a planner is asked with while the robot drives ahead, with new sensor data each time."""
    goal = field.scenario.goal or (5.0, 0.0)
    sensed = Situations(field, goal, Senses(), config.trial.history_s)
    generator = part_generator(field.scenario, field.seed, "motion")
    limit_s = config.trial.time_limit_s
    way = DriveInProgress(field.world, field.robot, field.scenario.motion, limit_s, generator)
    way.advance((SPEED, 0.0), FIRST_STEPS)
    for _ in range(number):
        way.advance((SPEED, 0.0), BETWEEN_STEPS)
        yield sensed.now(way)


def _line(name: str, planner: Planner, moments: list[Situation]) -> str:
    planner.command(moments[0])
    seconds, candidates, reasons = [], [], 0
    for situation in moments:
        begun = time.perf_counter()
        command = planner.command(situation)
        seconds.append(time.perf_counter() - begun)
        reasons += bool(command.reason) and command.considered is None
        if command.considered is not None:
            candidates.append(len(command.considered.velocities))
    median, slow = np.median(seconds), np.quantile(seconds, 0.9)
    number = np.median(candidates) if candidates else 0
    return (
        f"| {name} | {number:.0f} | {median * 1e3:.0f} | {slow * 1e3:.0f} | {1 / median:.1f} | "
        f"{reasons} |"
    )


HEADING = (
    "| bundle | candidates | median, ms | 90 %, ms | steps a second | without an answer |\n"
    "| --- | --- | --- | --- | --- | --- |"
)


if __name__ == "__main__":
    raise SystemExit(main())
