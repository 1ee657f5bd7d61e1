"""What roll-outs run over on a cost map: equation (12), and what the robot cannot stop before."""

from __future__ import annotations

import math

import cv2
import numpy as np

from graspe_data.arrays import Floats, Mask
from graspe_data.observation.intensity_map import inflate
from graspe_data.observation.trajectory import constant_velocity_arc
from graspe_data.robot import Footprint, Limits
from planners.body_discs import Body
from planners.cost_map import CostMap, values_at
from planners.goal import goal_seen_from
from planners.situation import Pose

_BESIDE = 0.15
"""Metres about the robot in which inflation bars nothing: it is there already, and may get out."""
_BRAKING_POSES = 10
"""Looked at along the way until the robot stands, at least; no more than a cell apart."""


class MapRollOuts:
    """A cost map under a robot's body, which stands where it is asked about.

    The body is a row of discs (see ``body_discs``). Cells within the footprint where the robot
    stands bar nothing, nor does inflation close beside it: it stands there.
    """

    def __init__(
        self,
        cost_map: CostMap,
        pose: Pose,
        footprint: Footprint,
        body: Body,
        margin: float = 0.0,
        berth: float = 0.0,
    ) -> None:
        """Take the map, where the robot is now (odometry frame), its footprint and its discs.

        Roll-outs keep ``margin`` metres more off barred cells, and what they cost takes in cells
        ``berth`` metres beside the body.
        """
        self._cell_m, self._offsets = cost_map.cell_m, body.discs[:, 0]
        self._origin = (
            *goal_seen_from(cost_map.pose, pose[:2]).tolist(),
            pose[2] - cost_map.pose[2],
        )
        # Obstacle cost under a disc: its sum over the disc and the berth, as a mean over the disc.
        kernel = _disc(float(body.discs[:, 1].max()) / cost_map.cell_m)
        beside = _disc((float(body.discs[:, 1].max()) + berth) / cost_map.cell_m)
        weights = beside.astype(np.float64) / np.count_nonzero(kernel)
        spread = cv2.filter2D(cost_map.cost, cv2.CV_32F, weights, borderType=cv2.BORDER_CONSTANT)
        self._mean = np.asarray(spread)
        # What the robot stands on, or beside, bars nothing.
        solid = cost_map.solid & ~self._under(footprint, len(cost_map.cost), 0.0)
        barred = cost_map.barred & ~self._under(footprint, len(cost_map.cost), _BESIDE)
        # Grown by the disc, a cell stands for all places of its centre that touch.
        self._solid = inflate(solid.astype(np.float32), kernel) > 0
        kernel = _disc((float(body.discs[:, 1].max()) + margin) / cost_map.cell_m)
        self._barred = inflate((barred | solid).astype(np.float32), kernel) > 0

    def cost(self, velocities: Floats, seconds: float, steps: int) -> Floats:
        """Equation (12), obs(v, w): the sum of the map's cells under each roll-out, float64 (K,).

        The roll-out is the swath of the body's foremost disc and the berth beside it. The sum is
        over its cells, divided by the cells across the disc alone: without a berth so many cells in
        a row of cost 1, whatever the robot's width; with one, as many more as the swath is wider.

        Args:
            velocities: (K, 2), m/s and rad/s.
            seconds: Length of the roll-outs.
            steps: Poses along them.
        """
        v, omega = velocities.T
        paths = constant_velocity_arc(v, omega, steps, seconds / steps)[:, 1:]
        front = self._placed(paths, float(self._offsets.max()))
        cells_a_step = np.abs(v) * (seconds / steps) / self._cell_m
        under = values_at(self._mean, front, self._cell_m).sum(axis=1, dtype=np.float64)
        charged: Floats = under * cells_a_step
        return charged

    def free(self, velocities: Floats, seconds: float, steps: int) -> Mask:
        """Whether the body keeps off the barred cells all along each roll-out, bool (K,).

        Args:
            velocities: (K, 2), m/s and rad/s.
            seconds: Length of the roll-outs.
            steps: Poses along them.
        """
        v, omega = velocities.T
        return self._keeps_off(
            self._barred, constant_velocity_arc(v, omega, steps, seconds / steps)
        )

    def room(self, velocities: Floats, limits: Limits, reaction_s: float) -> Mask:
        """Whether the robot can stop before its body runs over a solid cell, bool (K,).

        It is taken to drive at the velocity already.

        Looked at is the arc that it drives until it stands, after it has reacted and braked:
        v t + v^2 / 2a, and the same of the rotation. Inflation keeps a robot off, it takes no room.

        Args:
            velocities: (K, 2), m/s and rad/s.
            limits: Their accelerations are the decelerations.
            reaction_s: Time that passes before the robot brakes.
        """
        v, omega = velocities.T
        # The arc until it stands: at full speed while it reacts, then braking.
        metres = v * (reaction_s + np.abs(v) / (2 * limits.linear_acceleration))
        turned = omega * (reaction_s + np.abs(omega) / (2 * limits.yaw_acceleration))
        farthest = float(np.abs(metres).max(initial=0.0))
        poses = max(_BRAKING_POSES, math.ceil(farthest / self._cell_m))
        paths = constant_velocity_arc(metres, turned, poses, 1 / poses)
        return self._keeps_off(self._solid, paths)

    def _keeps_off(self, reached: Mask, paths: Floats) -> Mask:
        discs = [self._placed(paths, offset) for offset in self._offsets.tolist()]
        touched = values_at(reached, np.stack(discs), self._cell_m).any(axis=(0, 2))
        return np.logical_not(touched)

    def _under(self, footprint: Footprint, cells: int, beside: float) -> Mask:
        """The cells whose centres lie within the robot's rectangle, or so many metres beside it."""
        centres = (cells / 2 - 0.5 - np.arange(cells)) * self._cell_m
        forward, left, turn = self._origin
        x, y = centres[:, None] - forward, centres[None, :] - left
        cosine, sine = math.cos(turn), math.sin(turn)
        ahead, aside = np.abs(cosine * x + sine * y), np.abs(cosine * y - sine * x)
        return np.asarray(
            (ahead <= footprint.length / 2 + beside) & (aside <= footprint.width / 2 + beside)
        )

    def _placed(self, poses: Floats, offset: float) -> Floats:
        """Points ``offset`` metres ahead of poses (..., 3) in base_link now, in the map's frame."""
        x, y, yaw = poses[..., 0], poses[..., 1], poses[..., 2]
        px, py = x + offset * np.cos(yaw), y + offset * np.sin(yaw)
        forward, left, turn = self._origin
        cosine, sine = math.cos(turn), math.sin(turn)
        return np.stack((forward + cosine * px - sine * py, left + sine * px + cosine * py), -1)


def _disc(radius: float) -> Mask:
    """A kernel, bool (k, k), of the cells whose centres are within so many cells of its middle."""
    half = math.floor(radius)
    along = np.arange(-half, half + 1)
    return np.asarray(np.hypot(along[:, None], along[None, :]) <= radius)
