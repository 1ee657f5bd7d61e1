"""Which command to hold next: drawn at random, looked at in the world or not."""

from __future__ import annotations

import numpy as np

from graspe_data.arrays import Floats, Mask
from graspe_data.robot import Footprint, Robot
from graspe_data.simulation.motion.arc_contacts import failure_times
from graspe_data.simulation.motion.arc_samples import arc_poses
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from graspe_data.simulation.motion.planner_settings import PlannerSettings
from graspe_data.simulation.world.world import World

NEAR_S = 0.25
BRAKE_S = 1.0


class ArcChoice:
    """Draws legs from where the robot is."""

    def __init__(
        self, world: World, robot: Robot, settings: PlannerSettings, generator: np.random.Generator
    ) -> None:
        """Take the world that a cautious choice looks at."""
        self._world = world
        self._limits = robot.limits
        berth = 2 * settings.berth
        length, width = robot.footprint.length + berth, robot.footprint.width + berth
        self._footprint = Footprint(length=length, width=width)
        self._settings = settings
        self._generator = generator

    def temptation(self, pose: Floats) -> Floats | None:
        """A point (2,) of something near that could hold the robot; None where nothing is."""
        things = self._world.obstacles.having("stops", "entangles", "stumbles")
        share = self._generator.uniform(size=(len(things.radius), 1))
        points = things.start + share * (things.end - things.start)
        distance = np.hypot(*(points - pose[:2]).T) - things.radius
        near = np.flatnonzero(distance < self._settings.curious_reach)
        point: Floats | None = points[self._generator.choice(near)] if near.size else None
        return point

    def onward(self, pose: Floats, waypoint: Floats, caution: float) -> Leg | None:
        """An arc toward a waypoint (2,) from a pose (3,), or None where no arc is good.

        Every arc stays in the arena, or comes back to it; with the chance ``caution`` it also
        gets through the world for as long as it is held and the robot needs to brake after it.
        """
        hold = self.uniform(self._settings.hold_s)
        velocities = self._draw(pose, waypoint)
        good = self._stays(pose, velocities)
        if self._generator.random() < caution:
            poses, ahead = np.tile(pose, (len(velocities), 1)), hold + BRAKE_S
            good &= self._gets_through(poses, velocities, max(ahead, self._settings.outlook_s))
        if not good.any():
            return None
        v, omega = velocities[int(np.argmax(good))].tolist()
        return Leg(hold, v, omega)

    def turn(self, pose: Floats, way: float = 0.0) -> Leg:
        """A turn on the spot toward free ground, the least of some; else one at random.

        It goes the way round that ``way`` has the sign of; 0 leaves that to chance.
        """
        angles = self._generator.uniform(0.4, np.pi, self._settings.tries)
        signs = self._generator.choice((-1.0, 1.0), len(angles))
        angles = np.sort(angles) * (np.sign(way) if way else signs)
        rate = self.turn_rate()
        ahead = np.tile((self._settings.speed[0], 0.0), (len(angles), 1))
        turned = pose + np.outer(angles, (0.0, 0.0, 1.0))
        good = self._gets_through(turned, ahead, self._settings.outlook_s)
        good &= np.array([self._stays(place, ahead[:1])[0] for place in turned])
        good &= self._turns(pose, np.sign(angles) * rate, np.abs(angles) / rate)
        angle = float(angles[int(np.argmax(good))])
        return Leg(abs(angle) / rate, 0.0, float(np.copysign(rate, angle)))

    def turn_rate(self) -> float:
        """A rate of turns on the spot, rad/s, within the robot's limits."""
        drawn, (low, high) = self.uniform(self._settings.turn_rate), self._limits.yaw_rate
        return min(drawn, max(-low, high)) if max(-low, high) > 0 else drawn

    def uniform(self, limits: tuple[float, float]) -> float:
        """A number between two limits."""
        return float(self._generator.uniform(*limits))

    def _draw(self, pose: Floats, waypoint: Floats) -> Floats:
        """Commands (T, 2): the first ones toward the waypoint, the later ones anywhere."""
        tries = self._settings.tries
        aim = np.arctan2(waypoint[1] - pose[1], waypoint[0] - pose[0]) - pose[2]
        error = (aim + np.pi) % (2 * np.pi) - np.pi
        mean = error / sum(self._settings.hold_s) * 2
        spread = self._settings.yaw_spread * np.linspace(1.0, 3.0, tries)
        omega = self._generator.normal(np.clip(mean, *self._limits.yaw_rate), spread)
        v = self._generator.uniform(*self._settings.speed, tries)
        low, high = np.transpose([self._limits.linear_velocity, self._limits.yaw_rate])
        return np.clip(np.stack([v, omega], axis=1), low, high)

    def _stays(self, pose: Floats, velocities: Floats) -> Mask:
        """Whether arcs (T, 2) stay within the arena, or bring a robot back that is outside."""
        count = int(np.ceil(self._settings.hold_s[1] / NEAR_S))
        starts = np.tile(pose, (len(velocities), 1))
        outside = self._outside(arc_poses(starts, velocities, count, NEAR_S))
        stays: Mask = outside.max(axis=1) <= np.maximum(outside[:, 0] - 0.1, 0.0)
        returns: Mask = (outside[:, 0] > 0) & (outside[:, -1] < outside[:, 0] - NEAR_S)
        return stays | returns

    def _outside(self, poses: Floats) -> Floats:
        """How far poses (..., 3) are outside of the arena less its margin, metres."""
        low, high = np.reshape(self._world.arena, (2, 2))
        margin = self._settings.margin
        beyond = np.maximum(low + margin - poses[..., :2], poses[..., :2] - high + margin)
        outside: Floats = np.maximum(beyond, 0.0).max(axis=-1)
        return outside

    def _turns(self, pose: Floats, rates: Floats, durations: Floats) -> Mask:
        velocities = np.stack([np.zeros(len(rates)), rates], axis=1)
        poses = np.tile(pose, (len(rates), 1))
        turns: Mask = self._fails(poses, velocities, float(durations.max())) > durations
        return turns

    def _gets_through(self, poses: Floats, velocities: Floats, horizon_s: float) -> Mask:
        through: Mask = self._fails(poses, velocities, horizon_s) > horizon_s
        return through

    def _fails(self, poses: Floats, velocities: Floats, horizon_s: float) -> Floats:
        obstacles, mechanics = self._world.obstacles, MechanicsSettings()
        return failure_times(obstacles, self._footprint, poses, velocities, horizon_s, mechanics)
