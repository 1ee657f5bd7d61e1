"""From a trial that is over to what is written of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.simulation.field import Field
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.truth.events import true_events
from pipelines.trials.failures import explain
from pipelines.trials.logbook import Logbook
from pipelines.trials.run_trial import Run
from pipelines.trials.settings import TrialSettings
from pipelines.trials.trial import ControlTimes, Pose, Trial

PATH_STEP_S = 0.2


@dataclass(frozen=True)
class TrialIdentity:
    """Who drove, and the digests of ``Trial``."""

    method: str
    conditions: str
    driver: str = ""
    inputs: str = ""


def summarise(field: Field, run: Run, settings: TrialSettings, identity: TrialIdentity) -> Trial:
    """Count, measure and explain a trial.

    Args:
        field: Where it was.
        run: What happened.
        settings: How it was run.
        identity: Who drove, and under what.
    """
    drive, logbook = run.drive, run.logbook
    kinds = Counter(event.kind for event in true_events(drive))
    moving = [entry for entry in logbook.entries if entry.moves_on]
    poses = np.column_stack([drive.position[:, :2], drive.attitude[:, 2]])
    goal = field.scenario.goal or (0.0, 0.0)
    return Trial(
        scenario=field.scenario.name,
        seed=field.seed,
        **vars(identity),
        outcome=run.outcome,
        failure=explain(
            logbook, run.outcome, _failed_at(run), _pose(poses[-1]), settings.stalled_s
        ),
        duration_s=round(len(drive.time_s) * STEP_S, 2),
        path_m=float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()),
        straight_m=max(float(np.hypot(*(goal - poses[0, :2]))) - settings.goal_radius, STEP_S),
        collisions=kinds["collision"],
        stuck=kinds["stuck"],
        stumbles=kinds["stumble"],
        arcs=len(moving),
        arcs_free=int(logbook.free(moving).sum()),
        control=_times(logbook),
        safe_commands=_reasons(logbook),
        start=field.world.start,
        goal=goal,
        path_step_s=PATH_STEP_S,
        path=_thinned(poses),
    )


def _failed_at(run: Run) -> int:
    """The step at which the failure began that ended the trial; else the last step."""
    begun = [event.start_ns for event in true_events(run.drive) if event.kind == run.outcome]
    return round(begun[-1] * 1e-9 / STEP_S) if begun else len(run.drive.time_s)


def _reasons(logbook: Logbook) -> dict[str, int]:
    """How often the planner gave each reason, by the reason."""
    reasons = Counter(entry.command.reason for entry in logbook.entries)
    return {reason: count for reason, count in sorted(reasons.items()) if reason}


def _times(logbook: Logbook) -> ControlTimes:
    took = np.array([entry.took_s for entry in logbook.entries] or [0.0])
    return ControlTimes(
        answers=len(logbook.entries),
        mean_s=float(took.mean()),
        median_s=float(np.median(took)),
        p90_s=float(np.quantile(took, 0.9)),
    )


def _thinned(poses: Floats) -> tuple[Pose, ...]:
    every = round(PATH_STEP_S / STEP_S)
    kept = [*range(0, len(poses) - 1, every), len(poses) - 1]
    return tuple(_pose(poses[index]) for index in kept)


def _pose(row: Floats) -> Pose:
    x, y, yaw = (round(value, 3) for value in row.tolist())
    return x, y, yaw
