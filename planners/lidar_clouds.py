"""A situation's cloud as a planner may use it: in the lidar's frame, and of returns only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from graspe_data.observation.ring_recovery import recover_rings
from graspe_data.robot import Robot
from graspe_data.sensor_data import PointCloud
from planners.sensor_frame import SensorFrame
from planners.situation import Situation

LONGEST_RANGE = 1000.0
"""Metres; a return from farther away is damage."""

LEAST_RETURNS = 50
"""Returns of a lidar that sees."""
AHEAD, SECTORS, LEAST_SECTORS = np.pi / 3, 12, 6
"""rad to each side, the sectors in it, and in how many of them something must return."""
FARTHEST_MOUNTING = 5.0
"""Metres from base_link."""
_FAR_SHARE = 0.1
"""Returns beyond that which may be damage."""
_MORE = 1.5
"""Times as many rings as declared: by geometry a ring may be taken for two."""


class LidarClouds:
    """Takes the clouds of one lidar; all that drives by clouds takes them here."""

    def __init__(self, frame: str | None = None, rings: int | None = None) -> None:
        """Take the lidar's frame and its number of rings; None where the robot does not tell."""
        self._frame, self._rings = SensorFrame("lidar", frame), rings
        self._rings_checked = False

    @classmethod
    def of(cls, robot: Robot) -> LidarClouds:
        """Those of a robot's lidar."""
        return cls(robot.lidar.frame, robot.lidar.rings)

    def cloud(self, situation: Situation, mounting: Transform, minimum_range: float) -> PointCloud:
        """The situation's cloud, without what is no return.

        Args:
            situation: Its cloud is taken.
            mounting: Carries points of the lidar into base_link.
            minimum_range: Returns nearer to the lidar hit the robot itself, metres.

        Raises:
            PlannerError: There is none, or it is misshapen, of another frame or of another lidar,
                or of one that hardly sees.
        """
        cloud = situation.cloud
        if cloud is None:
            raise PlannerError("no cloud: obstacles are found in the lidar's latest cloud.")
        fault = misshapen(cloud)
        if fault:
            raise PlannerError(fault)
        self._frame.check(cloud.frame, situation.motions)
        self._check_rings(cloud)
        returned = _returns_of(cloud)
        fault = blind(returned.xyz, mounting, minimum_range)
        if fault:
            raise PlannerError(fault)
        return returned

    def in_base(
        self, situation: Situation, mounting: Transform, minimum_range: float
    ) -> NDArray[np.float32]:
        """The cloud's points (N, 3), metres, base_link.

        Args:
            situation: Its cloud is taken.
            mounting: Carries points of the lidar into base_link.
            minimum_range: Returns nearer to the lidar hit the robot itself, metres.

        Raises:
            PlannerError: See ``cloud``.
        """
        xyz = self.cloud(situation, mounting, minimum_range).xyz
        kept = xyz[np.einsum("ij,ij->i", xyz, xyz) >= minimum_range**2]
        return np.asarray(mounting.apply(kept), np.float32)

    def _check_rings(self, cloud: PointCloud) -> None:
        """Refuse the clouds of a lidar with more rings; geometry is asked once, it takes long."""
        if self._rings is None:
            return
        if cloud.ring is not None:
            wrong = cloud.ring[(cloud.ring < 0) | (cloud.ring >= self._rings)]
            found = f"a ring {int(wrong[0])}" if len(wrong) else ""
        else:
            number = (
                0 if self._rings_checked else len(np.unique(recover_rings(_returns_of(cloud).xyz)))
            )
            found = f"about {number} rings" if number > _MORE * self._rings else ""
        if found:
            raise PlannerError(
                f"the cloud has {found}, expected 0 to {self._rings - 1}: `lidar.rings` of the "
                f"robot manifest is {self._rings}; set it to the lidar's."
            )
        self._rings_checked = True


def blind(xyz: NDArray[np.floating], mounting: Transform, minimum_range: float) -> str:
    """Why a lidar hardly sees; empty where it does.

    A lidar that works sees the ground at least: where nothing returns, something covers it, and
    that is not free ground.

    Args:
        xyz: Returns (N, 3), metres, the lidar's frame.
        mounting: Carries them into base_link.
        minimum_range: Nearer ones hit the robot itself, or dirt on the lidar.
    """
    real = xyz[np.einsum("ij,ij->i", xyz, xyz) >= minimum_range**2]
    if len(real) < LEAST_RETURNS:
        return (
            f"the cloud has {len(real)} returns beyond {minimum_range:g} m, expected at least "
            f"{LEAST_RETURNS}: the lidar is covered, or sees nothing"
        )
    x, y = (real @ mounting.rotation[:2].T).T
    bearing = np.arctan2(y, x)
    ahead = bearing[np.abs(bearing) < AHEAD]
    seen = len(np.unique(np.floor((ahead + AHEAD) / (2 * AHEAD) * SECTORS)))
    if seen >= LEAST_SECTORS:
        return ""
    return (
        f"the cloud has returns in {seen} of {SECTORS} sectors ahead, expected at least "
        f"{LEAST_SECTORS}: the lidar is covered there"
    )


def sound_mounting(mounting: Transform) -> Transform:
    """A lidar's mounting, if it is one.

    Raises:
        PlannerError: Its rotation is none, or it is not finite, or far from the robot.
    """
    turn, place = np.asarray(mounting.rotation), np.asarray(mounting.translation)
    proper = np.allclose(turn @ turn.T, np.eye(3), atol=1e-3) and np.linalg.det(turn) > 0
    if not (proper and np.linalg.norm(place) <= FARTHEST_MOUNTING):
        raise PlannerError(
            f"the lidar's mounting is rotation {np.round(turn, 3).tolist()}, translation "
            f"{np.round(place, 3).tolist()}: expected a rotation, and at most "
            f"{FARTHEST_MOUNTING:g} m from base_link."
        )
    return mounting


def misshapen(cloud: PointCloud) -> str:
    """Why a cloud's arrays are none of a cloud; empty where they are."""
    xyz = cloud.xyz
    if _kind(xyz) != "f" or (xyz.ndim, xyz.shape[-1:]) != (2, (3,)):
        return f"the cloud is {_text(xyz)}, expected float32 (N, 3) in metres"
    for name, kinds in (("intensity", "fiu"), ("ring", "iu")):
        values = getattr(cloud, name)
        if values is None:
            continue
        if _kind(values) not in kinds or values.shape != (len(xyz),):
            return f"the cloud's {name} is {_text(values)}, expected {len(xyz)} numbers"
    return _far_away(xyz)


def _far_away(xyz: NDArray[np.floating]) -> str:
    """Whether so many returns are beyond what lidars see that they are in another unit."""
    with np.errstate(over="ignore", invalid="ignore"):
        square = np.einsum("ij,ij->i", xyz, xyz)
        far = np.count_nonzero(square > LONGEST_RANGE**2)
    if far <= _FAR_SHARE * np.count_nonzero(square > 0):
        return ""
    return f"{far} of the cloud's {len(xyz)} returns are beyond {LONGEST_RANGE:g} m, no metres"


def _kind(values: object) -> str:
    """NumPy's letter of a dtype; a space where it is no array."""
    return values.dtype.kind if isinstance(values, np.ndarray) else " "


def _text(values: object) -> str:
    if isinstance(values, np.ndarray):
        return f"{values.dtype} {values.shape}"
    return f"a {type(values).__name__}"


def returns(xyz: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Which rows (N,) of points (N, 3) are returns: finite, not the origin, within a kilometre."""
    with np.errstate(over="ignore", invalid="ignore"):
        square = np.einsum("ij,ij->i", xyz, xyz)
        real: NDArray[np.bool_] = (square > 0) & (square <= LONGEST_RANGE**2)
    return real


def _returns_of(cloud: PointCloud) -> PointCloud:
    real = returns(cloud.xyz)
    if real.all():
        return cloud
    return replace(
        cloud,
        xyz=cloud.xyz[real],
        intensity=None if cloud.intensity is None else cloud.intensity[real],
        ring=None if cloud.ring is None else cloud.ring[real],
    )
