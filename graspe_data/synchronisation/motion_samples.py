"""Odometry in time order: poses and twists of one body, cut where they do not go on."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Mask, Stamps
from graspe_data.geometry import Transform, rotation_from_quaternion
from graspe_data.robot import Limits
from graspe_data.synchronisation.differentiate import body_velocities
from graspe_data.synchronisation.rotation_steps import turns_in_fixed
from graspe_data.synchronisation.tracks import MotionTrack

SECOND: Final = 1_000_000_000
LONGEST_STEP_S: Final = 0.5
"""Samples further apart than this are not joined."""


@dataclass(frozen=True)
class MotionSamples:
    """One sample a stamp, N of them: ``stamps_ns`` ascends strictly.

    ``position`` (N, 3) metres and ``rotation`` (N, 3, 3) of the body in a frame that does not move,
    NaN where there is no pose. ``linear`` (N, 3) m/s and ``angular`` (N, 3) rad/s as published, NaN
    where there is no twist. ``segment`` (N,) counts up where a pose jumps or time leaps.
    ``repeated`` is the share of messages whose stamp stood before, with another pose. ``spikes``
    (K, 2) are the metres and seconds of poses that lay elsewhere than those before and after.
    """

    stamps_ns: Stamps
    position: Floats
    rotation: Floats
    linear: Floats
    angular: Floats
    segment: NDArray[np.int64]
    repeated: float = 0.0
    spikes: Floats = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def yaw(self) -> Floats:
        """The angle turned about the vertical since the first pose in rad, float64 (N,)."""
        return self.turned_about(np.array([0.0, 0.0, 1.0]))

    def turned_about(self, axis: Floats) -> Floats:
        """The angle turned about an axis (3,) of the fixed frame since the first pose, (N,)."""
        turned = np.full(self.stamps_ns.size, np.nan)
        known = np.isfinite(self.rotation).all(axis=(1, 2))
        steps = turns_in_fixed(self.rotation[known]) @ axis
        turned[known] = np.concatenate([[0.0], np.cumsum(steps)])[: np.count_nonzero(known)]
        return turned

    @property
    def jumps(self) -> NDArray[np.intp]:
        """The indices of the first samples behind a leap of the pose."""
        return np.flatnonzero(np.diff(self.segment)) + 1

    @property
    def joined(self) -> Mask:
        """Whether each sample and the next belong together, bool (N - 1,)."""
        near = np.diff(self.stamps_ns) <= round(LONGEST_STEP_S * SECOND)
        return np.asarray(near & (np.diff(self.segment) == 0))

    @property
    def pieces(self) -> list[NDArray[np.intp]]:
        """The indices of samples that belong together, piece by piece; none of an empty series."""
        if not self.stamps_ns.size:
            return []
        return np.split(np.arange(self.stamps_ns.size), np.flatnonzero(~self.joined) + 1)

    def only(self, kept: Mask) -> MotionSamples:
        """The samples of a mask (N,)."""
        return replace(
            self,
            stamps_ns=self.stamps_ns[kept],
            position=self.position[kept],
            rotation=self.rotation[kept],
            linear=self.linear[kept],
            angular=self.angular[kept],
            segment=self.segment[kept],
        )


def motion_samples(track: MotionTrack, stamps_ns: Stamps) -> MotionSamples:
    """Sort a track by time and keep the first message of each stamp.

    Messages whose pose or twist is not finite are left out, unless none of the track has one.

    Args:
        track: N messages.
        stamps_ns: Their times, int64 (N,).
    """
    # Infinite numbers are a fault; NaN stands for what a message does not tell.
    sound = _finite(track.position) & _finite(track.quaternion) & _finite(track.twist)
    track, stamps_ns = track.only(sound), stamps_ns[sound]
    # Of several messages with one stamp the first counts; how many moved beside it is kept.
    stamps, first, inverse = np.unique(stamps_ns, return_index=True, return_inverse=True)
    moved = np.linalg.norm(track.position - track.position[first][inverse], axis=1) > 1e-3  # noqa: PLR2004
    # A quaternion of zeros is no rotation.
    length = np.linalg.norm(track.quaternion[first], axis=1)
    turned = np.isfinite(length) & (length > 0)
    rotation = np.full((stamps.size, 3, 3), np.nan)
    rotation[turned] = rotation_from_quaternion(track.quaternion[first][turned])
    return MotionSamples(
        stamps_ns=stamps,
        position=track.position[first],
        rotation=rotation,
        linear=track.twist[first, :3],
        angular=track.twist[first, 3:],
        segment=np.zeros(stamps.size, np.int64),
        repeated=float(np.count_nonzero(moved)) / max(1, stamps_ns.size),
    )


def _finite(values: Floats) -> Mask:
    """The rows (N, D) whose numbers are finite; all where none is."""
    finite = np.asarray(np.isfinite(values).all(axis=1))
    return finite if finite.any() else np.ones(finite.size, np.bool_)


def carried_to_base(samples: MotionSamples, child_from_base: Transform) -> MotionSamples:
    """The motion of the base frame, which is fixed on the body that the samples are of.

    The twist is taken as the body's own: its frame follows ``child_from_base`` too.
    """
    offset, turn = child_from_base.translation, child_from_base.rotation
    lever = np.cross(samples.angular, offset)
    return replace(
        samples,
        position=samples.position + samples.rotation @ offset,
        rotation=samples.rotation @ turn,
        linear=(samples.linear + lever) @ turn,
        angular=samples.angular @ turn,
    )


def twist_in_body(samples: MotionSamples) -> MotionSamples:
    """Turn a twist that is given in the fixed frame into the body's."""
    turned = np.swapaxes(samples.rotation, 1, 2)
    return replace(
        samples,
        linear=np.einsum("nij,nj->ni", turned, samples.linear),
        angular=np.einsum("nij,nj->ni", turned, samples.angular),
    )


def differentiated(samples: MotionSamples) -> Floats:
    """Velocity along body x in m/s and yaw rate in rad/s by the poses, (N, 2), within segments."""
    velocity = np.full((samples.stamps_ns.size, 2), np.nan)
    for piece in samples.pieces:
        linear, yaw_rate = body_velocities(
            samples.stamps_ns[piece], samples.position[piece], samples.rotation[piece]
        )
        velocity[piece] = np.stack([linear, yaw_rate], axis=1)
    return velocity


def driven_limits(track: MotionTrack) -> Limits:
    """So wide that what was driven fits, and leaps do not: half as much again as nearly always."""
    own = track.stamps.header_ns
    samples = motion_samples(track, track.stamps.bag_ns if own is None or not own.any() else own)
    fastest = 1.5 * _usual_speed(samples) + 0.5
    quickest = 1.5 * _usual_rate(samples) + 0.5
    return Limits(linear_velocity=(-fastest, fastest), yaw_rate=(-quickest, quickest))


def _usual_speed(samples: MotionSamples) -> float:
    published = np.linalg.norm(samples.linear, axis=1)
    return max(_high(published), _high(_per_second(samples, samples.position)))


def _usual_rate(samples: MotionSamples) -> float:
    heading = samples.yaw[:, None]
    return max(_high(np.abs(samples.angular[:, 2])), _high(_per_second(samples, heading)))


def _per_second(samples: MotionSamples, values: Floats) -> Floats:
    """How far values (N, D) go within a second, over that second."""
    seconds = (samples.stamps_ns - samples.stamps_ns[:1]) * 1e-9
    later = np.searchsorted(seconds, seconds + 1.0)
    begin = np.flatnonzero(later < seconds.size)
    if not begin.size:
        begin, later = np.array([0]), np.full(max(1, seconds.size), max(0, seconds.size - 1))
    span = np.maximum(seconds[later[begin]] - seconds[begin], 1e-3)
    return np.asarray(np.linalg.norm(values[later[begin]] - values[begin], axis=1) / span)


def _high(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.percentile(known, 98)) if known.size else 0.0
