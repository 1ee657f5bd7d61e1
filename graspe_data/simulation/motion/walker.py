"""One step of a robot among obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.motion.mechanics import FREE, STOPS, MechanicsSettings, grip_of
from graspe_data.simulation.motion.stumbling import Stumbling
from graspe_data.simulation.motion.surroundings import Surroundings
from graspe_data.simulation.world.obstacles import Obstacles

GAP = 0.001
FRACTIONS = np.linspace(0.0, 1.0, 17)

Velocity = tuple[float, float]


@dataclass(frozen=True)
class Step:
    """What one step did: the velocity reached, and what touched the robot (see ``Contacts``)."""

    velocity: Velocity
    stopped: bool = False
    impact: float = 0.0
    speed_share: float = 1.0
    entangled: bool = False


class Walker:
    """A unicycle with limited acceleration that things stop, hold, slow and throw."""

    def __init__(
        self,
        obstacles: Obstacles,
        robot: Robot,
        settings: MechanicsSettings,
        stumbling: Stumbling,
        pose: tuple[float, float, float],
    ) -> None:
        """Stand at a pose x, y, yaw in the world, metres, rad."""
        self.pose: Floats = np.array(pose, np.float64)
        self._around = Surroundings(obstacles, robot.footprint)
        self._settings = settings
        self._stumbling = stumbling
        limits = robot.limits
        self._changes = (limits.linear_acceleration * STEP_S, limits.yaw_acceleration * STEP_S)
        self._legs: Velocity = (0.0, 0.0)
        self._gaps: Floats = np.empty(0)
        self._free = 0.0
        self._known = False
        self._meet()

    def step(self, index: int, command: Velocity, slip: float) -> Step:
        """Go on for ``STEP_S``.

        Args:
            index: Of the step.
            command: v in m/s and omega in rad/s.
            slip: Share of the speed that is lost.
        """
        grip = FREE if self._free > 0 else grip_of(self._around.near, self._gaps)
        slowed = grip.slowed * self._stumbling.share(index)
        self._legs = self._toward((command[0] * slowed, command[1] * slowed))
        held = self._held_share(grip.load) if grip.load else 1.0
        wanted = (self._legs[0] * held * (1 - slip), self._legs[1] * held * (1 - slip))
        free = self._free > self._around.way(*wanted, STEP_S)
        done = self._go_freely(wanted) if free else self._go_carefully(index, wanted)
        share = grip.slowed * grip.held_share
        return Step(done.velocity, done.stopped, done.impact, share, grip.load > 0)

    def _toward(self, target: Velocity) -> Velocity:
        v, omega = (
            now + min(max(goal - now, -most), most)
            for now, goal, most in zip(self._legs, target, self._changes, strict=True)
        )
        return v, omega

    def _held_share(self, load: float) -> float:
        """Less and less on the way in; on the way out, what is needed to get out."""
        share = float(np.exp(-load))
        gaps = self._around.gaps(advance(self.pose, *self._legs, STEP_S)[None])[0]
        leaving = grip_of(self._around.near, gaps).load < load
        return max(share, self._settings.leaving_share) if leaving else share

    def _go_freely(self, velocity: Velocity) -> Step:
        self.pose = advance(self.pose, *velocity, STEP_S)
        self._free -= self._around.way(*velocity, STEP_S)
        self._known = False
        return Step(velocity)

    def _go_carefully(self, index: int, velocity: Velocity) -> Step:
        if not self._known or self._around.left(self.pose):
            self._meet()
        done = Step(velocity) if self._go(velocity) else self._stop(velocity)
        speed = abs(velocity[0]) + abs(velocity[1]) / 2
        self._stumbling.tread(index, self._around, self._gaps, speed)
        return done

    def _stop(self, velocity: Velocity) -> Step:
        """Up to the solid thing; pressed against it, a turn alone may still be free."""
        impact = abs(velocity[0])
        bounced = impact >= self._settings.rebound_speed
        back = -self._settings.rebound * velocity[0] if bounced else 0.0
        self._touch(velocity)
        turns = velocity[1] if self._go((0.0, velocity[1])) else 0.0
        self._legs = (back, turns)
        return Step((back, turns), stopped=True, impact=impact)

    def _go(self, velocity: Velocity) -> bool:
        """Take the step, unless something solid is in the way."""
        pose = advance(self.pose, *velocity, STEP_S)
        gaps = self._around.gaps(pose[None])
        if self._blocked(gaps)[0]:
            return False
        self.pose = pose
        self._settle(gaps[0])
        return True

    def _touch(self, velocity: Velocity) -> None:
        """Go on to the last of some parts of the step at which nothing solid is in the way."""
        poses = np.stack([advance(self.pose, *velocity, part * STEP_S) for part in FRACTIONS])
        gaps = self._around.gaps(poses)
        last = max(int(np.argmax(self._blocked(gaps))) - 1, 0)
        self.pose = poses[last]
        self._settle(gaps[last])

    def _blocked(self, gaps: Floats) -> NDArray[np.bool_]:
        """Whether gaps (P, N) are less than a solid thing allows, and less than they are, (P,)."""
        nearer = (gaps < GAP) & (gaps < self._gaps - 1e-9)
        blocked: NDArray[np.bool_] = (nearer & (self._around.near.effect == STOPS)).any(axis=1)
        return blocked

    def _meet(self) -> None:
        self._settle(self._around.look(self.pose))

    def _settle(self, gaps: Floats) -> None:
        self._gaps, self._known = gaps, True
        self._free = self._around.free_way(gaps) - 2 * GAP


def advance(pose: Floats, v: float, omega: float, seconds: float) -> Floats:
    """The pose (3,) after a time at constant velocity; the chord of the arc."""
    half = omega * seconds / 2
    chord = v * seconds * float(np.sinc(half / np.pi))
    heading = pose[2] + half
    return np.array(
        [
            pose[0] + chord * np.cos(heading),
            pose[1] + chord * np.sin(heading),
            pose[2] + 2 * half,
        ]
    )
