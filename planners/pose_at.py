"""Where the robot was when a cloud was taken."""

from __future__ import annotations

import math

import numpy as np

from graspe_data.geometry import Transform, roll_pitch_yaw
from planners.fitness import FARTHEST
from planners.situation import Pose, Situation

_SAME = 0.05
"""Metres and rad between the pose and where the motions lead, within which they have one frame."""
_STRAIGHT = 1e-9


def pose_at(situation: Situation, stamp_ns: int) -> Pose:
    """base_link in the frame of the situation's pose at a stamp: x, y in metres and yaw in rad.

    The motions tell how the robot moved from then until now; the pose tells where it is now. So a
    pose by a localisation and motions by odometry are never joined as if they had one frame.
    Between motions by linear interpolation; before the first the first one; after the last the
    velocity of the situation goes on.

    Args:
        situation: Motions without stamp or pose, with one that is damaged, or later than now, do
            not count.
        stamp_ns: On the clock of the situation.
    """
    # Odometry before now; the pose of now may be of another frame.
    moved = _poses(situation)
    if not moved:
        return situation.pose
    # Where odometry itself has the robot now: the last pose, driven on.
    last_ns, last = moved[-1]
    passed_s = (situation.now_ns - last_ns) / 1e9
    now = _joined(last, _arc(situation.velocity, passed_s))
    if math.dist(now, situation.pose) < _SAME:
        poses = [*moved, (situation.now_ns, situation.pose)]
        return _interpolated(poses, stamp_ns, situation.now_ns)
    # Of another frame: the way from then to now is odometry's, the place is the pose's.
    then = _interpolated([*moved, (situation.now_ns, now)], stamp_ns, situation.now_ns)
    return _joined(situation.pose, _between(now, then))


def _interpolated(moved: list[tuple[int, Pose]], stamp_ns: int, now_ns: int) -> Pose:
    stamps = np.array([stamp for stamp, _ in moved], np.int64)
    x, y, yaw = np.array([pose for _, pose in moved], np.float64).T
    # Stamps count from now: as float64 they would be off by hundreds of nanoseconds.
    when, since = float(stamp_ns - now_ns), (stamps - now_ns).astype(float)
    found = [float(np.interp(when, since, axis)) for axis in (x, y, np.unwrap(yaw))]
    return found[0], found[1], found[2]


def _arc(velocity: tuple[float, float], seconds: float) -> Pose:
    """Where a velocity leads in so many seconds, from the origin."""
    v, omega = velocity
    half = 0.5 * omega * seconds
    way = v * seconds * (math.sin(half) / half if abs(half) > _STRAIGHT else 1.0)
    return way * math.cos(half), way * math.sin(half), 2 * half


def _joined(pose: Pose, step: Pose) -> Pose:
    """A step that was told in a pose's own axes, told in the pose's frame."""
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    x, y, yaw = step
    return pose[0] + cosine * x - sine * y, pose[1] + sine * x + cosine * y, pose[2] + yaw


def _between(first: Pose, second: Pose) -> Pose:
    """The second pose in the axes of the first."""
    cosine, sine = math.cos(first[2]), math.sin(first[2])
    x, y = second[0] - first[0], second[1] - first[1]
    return cosine * x + sine * y, cosine * y - sine * x, second[2] - first[2]


def _poses(situation: Situation) -> list[tuple[int, Pose]]:
    poses = []
    for motion in situation.motions:
        stamp, place, turn = motion.stamp_ns, motion.position, motion.quaternion
        if stamp is None or place is None or turn is None or stamp >= situation.now_ns:
            continue
        if not (np.abs((*place, *turn)) <= FARTHEST).all():  # NaN is not either
            continue
        transform = Transform.from_quaternion(np.array(place), np.array(turn))
        yaw = float(roll_pitch_yaw(transform.rotation)[2])
        poses.append((stamp, (float(place[0]), float(place[1]), yaw)))
    return sorted(dict(poses).items())
