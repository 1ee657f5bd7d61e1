"""When a trial is over, and how it ended."""

from __future__ import annotations

import numpy as np

from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress
from graspe_data.simulation.truth.events import EventSettings, true_events
from graspe_data.simulation.world.world import World
from pipelines.trials.settings import TrialSettings
from pipelines.trials.trial import Outcome
from planners.situation import Situation


class Referee:
    """Watches a robot on its way to a goal."""

    def __init__(self, world: World, settings: TrialSettings) -> None:
        """Take the world that the robot drives in."""
        self._arena = np.reshape(world.arena, (2, 2)) + settings.arena_margin * np.array(
            [[-1], [1]]
        )
        self._settings = settings
        self._impact = EventSettings().impact
        self._step = 0
        self._place, self._got_there = np.array(world.start[:2]), 0

    def verdict(self, way: DriveInProgress, situation: Situation) -> Outcome | None:
        """How the trial has ended at this step, or None where it goes on.

        The robot has arrived where its odometry says so: nothing tells it more of a goal that was
        given by odometry. All else is as it is in the world.

        Args:
            way: What really happens.
            situation: What the robot knows of it.
        """
        place = np.array(way.state.pose[:2])
        contacts, self._step = way.contacts(self._step), way.steps
        if (contacts.impact >= self._impact).any():
            return "collision"
        if np.hypot(*np.subtract(situation.goal, situation.pose[:2])) <= self._settings.goal_radius:
            return "success"
        if (contacts.stopped | contacts.entangled).any() and self._is_stuck(way):
            return "stuck"
        if ((place < self._arena[0]) | (place > self._arena[1])).any():
            return "left_arena"
        if self._is_stalled(place, way.steps):
            return "stuck" if contacts.stopped[-1] or contacts.entangled[-1] else "stalled"
        return "timeout" if way.over else None

    def _is_stuck(self, way: DriveInProgress) -> bool:
        """Whether something has held the robot for all of the last ``stuck_s``."""
        steps = round(self._settings.stuck_s / STEP_S)
        if way.steps <= steps:
            return False
        events = true_events(way.drive(way.steps - steps - 1))
        lasting = (self._settings.stuck_s - 2 * STEP_S) * 1e9
        return any(e.kind == "stuck" and e.stop_ns - e.start_ns >= lasting for e in events)

    def _is_stalled(self, place: np.ndarray[tuple[int], np.dtype[np.float64]], steps: int) -> bool:
        if np.hypot(*(place - self._place)) >= self._settings.stalled_m:
            self._place, self._got_there = place, steps
        return (steps - self._got_there) * STEP_S >= self._settings.stalled_s
