"""One trial: a planner drives the simulated robot until it arrives or fails."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from graspe_data.errors import StageError
from graspe_data.manifest import validate
from graspe_data.simulation.field import Field, part_generator
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from graspe_data.simulation.scenario import Scenario
from pipelines.trials.logbook import Logbook, LogEntry
from pipelines.trials.referee import Referee
from pipelines.trials.settings import TrialSettings
from pipelines.trials.situations import Senses, Situations
from pipelines.trials.trial import Outcome
from pipelines.trials.witness import Witness
from planners.situation import Planner, Situation

STANDING_STEPS = 20
"""Steps that the robot stands at first, so that its sensors have something to say."""


@dataclass(frozen=True)
class Run:
    """A trial that is over: how it ended, the whole drive, and what the planner answered."""

    outcome: Outcome
    drive: Drive
    logbook: Logbook


def trial_scenario(
    scenario: Scenario, settings: TrialSettings, goal: tuple[float, float] | None = None
) -> Scenario:
    """The scenario of a trial: as long as a trial may be, its sensors at the trial's rate.

    Args:
        scenario: Where the robot drives.
        settings: How the trial is run.
        goal: Metres, world frame; None is the scenario's own.

    Raises:
        StageError: It has no goal.
        ManifestError: The goal lies outside of the arena, or the sensors' rate does not fit.
    """
    goal = goal or scenario.goal
    if goal is None:
        raise StageError(
            f"{scenario.name}: a trial needs a goal, and this scenario has none: give `--goal X Y`,"
            f" add `goal: [x, y]` to it, or take one that has."
        )
    changes = scenario.model_dump() | {"duration_s": settings.time_limit_s, "goal": goal}
    if settings.sensor_rate is not None:
        for sensor in ("camera", "lidar"):
            changes[sensor]["rate"] = settings.sensor_rate
    return validate(changes, Scenario, f"{scenario.name}, as a trial")


def run_trial(
    field: Field,
    planner: Planner,
    settings: TrialSettings,
    senses: Senses,
    witness: Witness | None = None,
) -> Run:
    """Drive until the robot arrives, fails, or runs out of time.

    The planner is told what the sensors have handed on by then, and its pose by odometry; its
    answer is held until it is asked again. The simulation stands still while it thinks. All
    planners meet the same world, slip, stumbles, odometry errors and noise.

    Args:
        field: Of ``trial_scenario``.
        planner: Who drives.
        settings: When the trial is over.
        senses: The sensors that are simulated.
        witness: Who sees the true pose before each question, where a method asks the world.

    Raises:
        StageError: The scenario has no goal.
    """
    scenario, robot, world = field.scenario, field.robot, field.world
    if scenario.goal is None:
        raise StageError(f"{scenario.name}: a trial needs a goal: see `trial_scenario`.")
    generator = part_generator(scenario, field.seed, "motion")
    way = DriveInProgress(world, robot, scenario.motion, settings.time_limit_s, generator)
    situations = Situations(field, scenario.goal, senses, settings.history_s)
    referee = Referee(world, settings)
    logbook = Logbook(world, robot, scenario.motion.mechanics)
    way.advance((0.0, 0.0), STANDING_STEPS)
    outcome = None
    while outcome is None:
        situation = situations.now(way)
        outcome = referee.verdict(way, situation)
        if outcome is None:
            if witness is not None:
                witness.see(way.state.pose)
            entry = _ask(planner, situation, way)
            logbook.entries.append(entry)
            way.advance(entry.velocity, settings.control_steps)
    return Run(outcome, way.drive(), logbook)


def _ask(planner: Planner, situation: Situation, way: DriveInProgress) -> LogEntry:
    pose = way.state.pose
    begun = time.perf_counter()
    command = planner.command(situation)
    took = time.perf_counter() - begun
    velocity = np.array([command.linear_velocity, command.yaw_rate])
    if not np.isfinite(velocity).all():
        raise StageError(
            f"The planner asked for {velocity} m/s and rad/s, which no robot can drive."
        )
    return LogEntry(way.steps, pose, command, took)
