"""Why a trial failed: what the planner believed against what is true in the world."""

from __future__ import annotations

from collections import Counter

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.motion.footprint import clearance
from pipelines.trials.logbook import MOVES_ON, Logbook, LogEntry
from pipelines.trials.trial import Failure, FailureKind, Outcome, Pose

HORIZON_S = 3.0
"""Seconds before a contact of which the commands are looked at: the horizon of the models."""
SAMPLES = 20
"""Of the commands of a robot that does not get on."""
TOUCHING = 0.1
"""Metres."""


def explain(
    logbook: Logbook, outcome: Outcome, failed_at: int, pose: Pose, patience_s: float
) -> Failure | None:
    """Say why a trial failed; None for a success.

    A robot that ran into something is explained by its commands in the horizon before: if the model
    accepted an arc there that fails in the world, the perception failed. One that got no further is
    explained by what most of its last commands waited for: a model had rejected arcs that get
    through (the threshold), no arc of any velocity got through (the world), or else the planner.

    Args:
        logbook: All commands, with the world.
        outcome: How the trial ended.
        failed_at: The step of the drive at which the failure began.
        pose: Where the robot is in the end, x, y in metres and yaw in rad, world frame.
        patience_s: Seconds before the end of which the commands of a robot are looked at that got
            no further.
    """
    before = [entry for entry in logbook.entries if entry.step <= failed_at]
    if outcome == "success" or not before:
        return None
    ran_into = outcome in ("collision", "stuck")
    moving = [entry for entry in before if entry.moves_on]
    last = moving[-1] if ran_into and moving else before[-1]
    since = failed_at - (HORIZON_S if ran_into else patience_s) / STEP_S
    recent = [entry for entry in (moving if ran_into else before) if entry.step >= since] or [last]
    return Failure(
        kind=_contact(logbook, recent) if ran_into else _standstill(logbook, recent),
        told=last.velocity,
        predicted=last.predicted,
        free=bool(logbook.free([last])[0]),
        obstacle=_touched(logbook, pose) if ran_into else "",
    )


def _contact(logbook: Logbook, recent: list[LogEntry]) -> FailureKind:
    believed = np.array([entry.predicted is not None for entry in recent])
    return "perception" if (believed & ~logbook.free(recent)).any() else "planner"


def _standstill(logbook: Logbook, entries: list[LogEntry]) -> FailureKind:
    waiting = [entry for entry in entries if not entry.moves_on]
    if len(waiting) < len(entries) / 2:
        return "planner"
    chosen = np.unique(np.linspace(0, len(waiting) - 1, SAMPLES).astype(int))
    kinds = Counter(_waits_for(logbook, waiting[index]) for index in chosen.tolist())
    return kinds.most_common(1)[0][0]


def _waits_for(logbook: Logbook, entry: LogEntry) -> FailureKind:
    """Why a command did not ask the robot to move on."""
    scored = entry.scored
    onward = np.empty((0, 2)) if scored is None else scored.velocities
    onward = onward[onward[:, 0] >= MOVES_ON]
    if logbook.free_candidates(entry, onward).any():
        return "threshold"
    return "planner" if logbook.free_candidates(entry, _all_ways(logbook)).any() else "world"


def _all_ways(logbook: Logbook) -> Floats:
    """Velocities (K, 2) that move on, over the robot's limits."""
    limits = logbook.robot.limits
    speeds = np.linspace(0.25, 1.0, 3) * limits.linear_velocity[1]
    turns = np.linspace(*limits.yaw_rate, 9)
    return np.stack(np.meshgrid(speeds, turns), axis=-1).reshape(-1, 2)


def _touched(logbook: Logbook, pose: Pose) -> str:
    """The material of what holds or stops the robot at a pose; empty where nothing does."""
    solid = logbook.world.obstacles.having("stops", "entangles")
    gaps = clearance(logbook.robot.footprint, np.array([pose]), solid)[0]
    nearest = int(gaps.argmin()) if gaps.size else -1
    return solid.material[nearest] if nearest >= 0 and gaps[nearest] <= TOUCHING else ""
