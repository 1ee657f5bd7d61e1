"""Where the robot was when a cloud was taken."""

from __future__ import annotations

import numpy as np

from graspe_data.geometry import Transform, roll_pitch_yaw
from planners.fitness import FARTHEST
from planners.situation import Situation

Pose = tuple[float, float, float]


def pose_at(situation: Situation, stamp_ns: int) -> Pose:
    """base_link in the odometry frame at a stamp: x, y in metres and yaw in rad.

    Between the poses of the situation's motions and its own at ``now_ns`` by linear interpolation;
    outside of them the nearest one.

    Args:
        situation: Motions without stamp or pose, with one that is damaged, or later than now, do
            not count.
        stamp_ns: On the clock of the situation.
    """
    known = dict(_poses(situation)) | {situation.now_ns: situation.pose}
    stamps = np.array(sorted(known), np.int64)
    x, y, yaw = np.array([known[stamp] for stamp in stamps.tolist()], np.float64).T
    # Stamps count from now: as float64 they would be off by hundreds of nanoseconds.
    when, since = float(stamp_ns - situation.now_ns), (stamps - situation.now_ns).astype(float)
    found = [float(np.interp(when, since, axis)) for axis in (x, y, np.unwrap(yaw))]
    return found[0], found[1], found[2]


def _poses(situation: Situation) -> list[tuple[int, Pose]]:
    poses = []
    for motion in situation.motions:
        stamp, place, turn = motion.stamp_ns, motion.position, motion.quaternion
        if stamp is None or place is None or turn is None or stamp >= situation.now_ns:
            continue
        if not (np.abs((*place, *turn)) <= FARTHEST).all():  # NaN is not either
            continue
        seen = Transform.from_quaternion(np.array(place), np.array(turn))
        yaw = float(roll_pitch_yaw(seen.rotation)[2])
        poses.append((stamp, (float(place[0]), float(place[1]), yaw)))
    return poses
