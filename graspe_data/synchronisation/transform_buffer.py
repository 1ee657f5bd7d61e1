"""Transforms between frames at a time: fixed edges by the latest word, moving ones interpolated."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Mask, Stamps
from graspe_data.errors import GeometryError
from graspe_data.geometry import Transform, plain_frame, rotation_from_quaternion

Edge = tuple[str, str]

LONGEST_GAP_S: Final = 0.5
_SECOND: Final = 1_000_000_000


@dataclass(frozen=True)
class Poses:
    """Transforms at N times: ``rotation`` (N, 3, 3), ``translation`` (N, 3) metres.

    Where ``known`` (N,) is false, the recording does not say.
    """

    rotation: Floats
    translation: Floats
    known: Mask

    def __matmul__(self, inner: Poses) -> Poses:
        """These transforms after ``inner``, time by time."""
        moved = np.einsum("nij,nj->ni", self.rotation, inner.translation) + self.translation
        return Poses(self.rotation @ inner.rotation, moved, self.known & inner.known)

    def inverse(self) -> Poses:
        """The transforms the other way."""
        turned = np.swapaxes(self.rotation, 1, 2)
        return Poses(turned, -np.einsum("nij,nj->ni", turned, self.translation), self.known)

    def at(self, index: int) -> Transform:
        """One of them."""
        return Transform(self.rotation[index], self.translation[index])


@dataclass(frozen=True)
class FixedEdge:
    """A transform that stays until the next one is published: ``stamps_ns`` (K,) ascends."""

    stamps_ns: Stamps
    transforms: tuple[Transform, ...]

    def at(self, stamps_ns: Stamps) -> Poses:
        """The latest at or before each time; before the first, the first."""
        latest = np.searchsorted(self.stamps_ns, stamps_ns, side="right") - 1
        chosen = np.maximum(latest, 0)
        rotation = np.stack([t.rotation for t in self.transforms])
        translation = np.stack([t.translation for t in self.transforms])
        known = np.ones(stamps_ns.size, np.bool_)
        return Poses(rotation[chosen], translation[chosen], known)


@dataclass(frozen=True)
class MovingEdge:
    """Samples of a moving frame: ``stamps_ns`` (M,) ascends strictly, metres, quaternions xyzw."""

    stamps_ns: Stamps
    translation: Floats
    quaternion: Floats
    segment: NDArray[np.int64]
    """Between samples of two segments (M,) nothing is interpolated."""

    def at(self, stamps_ns: Stamps) -> Poses:
        """Interpolated between samples no further apart than half a second; never beyond them."""
        stamps = self.stamps_ns
        if stamps.size == 1:
            there = stamps_ns == stamps[0]
            rotation = rotation_from_quaternion(self.quaternion)
            return Poses(
                np.repeat(rotation, stamps_ns.size, axis=0),
                np.repeat(self.translation, stamps_ns.size, axis=0),
                there,
            )
        left = np.clip(np.searchsorted(stamps, stamps_ns, side="right") - 1, 0, stamps.size - 2)
        span = stamps[left + 1] - stamps[left]
        share = (stamps_ns - stamps[left]) / span
        exact = (stamps_ns == stamps[left]) | (stamps_ns == stamps[left + 1])
        inside = (stamps_ns >= stamps[0]) & (stamps_ns <= stamps[-1])
        joined = (span <= round(LONGEST_GAP_S * _SECOND)) & (
            self.segment[left] == self.segment[left + 1]
        )
        before, after = self.translation[left], self.translation[left + 1]
        translation = before + share[:, None] * (after - before)
        turned = interpolate_rotation(self.quaternion[left], self.quaternion[left + 1], share)
        return Poses(rotation_from_quaternion(turned), translation, exact | (inside & joined))


def interpolate_rotation(first: Floats, second: Floats, share: Floats) -> Floats:
    """Quaternions (N, 4) on the shorter great arc from ``first`` to ``second`` (slerp).

    ``share`` (N,) is clipped to [0, 1].
    """
    unit = [q / np.linalg.norm(q, axis=1, keepdims=True) for q in (first, second)]
    # Of the two quaternions of the second rotation, the one nearer to the first.
    cosine = np.einsum("ni,ni->n", *unit)
    nearer = np.where(cosine < 0, -1.0, 1.0)[:, None] * unit[1]
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    part = np.clip(share, 0.0, 1.0)
    # Slerp: sin((1 - s) a) / sin a and sin(s a) / sin a; along a line where the angle is tiny.
    sine = np.sin(angle)
    small = sine < 1e-6  # noqa: PLR2004 - there the arc is a line
    safe = np.where(small, 1.0, sine)
    left = np.where(small, 1.0 - part, np.sin((1.0 - part) * angle) / safe)
    right = np.where(small, part, np.sin(part * angle) / safe)
    blended: Floats = left[:, None] * unit[0] + right[:, None] * nearer
    return blended


class TransformBuffer:
    """All edges of a recording on one time axis, int64 ns."""

    def __init__(
        self, fixed: Mapping[Edge, FixedEdge], moving: Mapping[Edge, MovingEdge] | None = None
    ) -> None:
        """Take edges (parent, child); an edge that is fixed and moving counts as moving."""
        self.edges: dict[Edge, FixedEdge | MovingEdge] = {**fixed, **(moving or {})}
        self._neighbours: dict[str, list[str]] = {}
        for parent, child in self.edges:
            self._neighbours.setdefault(parent, []).append(child)
            self._neighbours.setdefault(child, []).append(parent)
        self._paths: dict[tuple[str, str], list[str]] = {}
        self._fixed: dict[tuple[str, str], list[tuple[int, Transform]]] = {}

    @classmethod
    def of_fixed(cls, edges: Mapping[Edge, Transform]) -> Self:
        """A buffer of transforms that never change."""
        always = np.zeros(1, np.int64)
        return cls(
            {
                (plain_frame(parent), plain_frame(child)): FixedEdge(always, (transform,))
                for (parent, child), transform in edges.items()
            }
        )

    @property
    def frames(self) -> list[str]:
        """All frames, sorted."""
        return sorted(self._neighbours)

    def path(self, target: str, source: str) -> list[str]:
        """The frames from ``target`` to ``source`` along the fewest edges.

        Raises:
            GeometryError: The frames do not connect; the text lists those that are known.
        """
        if (target, source) not in self._paths:
            self._paths[target, source] = self._shortest(target, source)
        return self._paths[target, source]

    def _shortest(self, target: str, source: str) -> list[str]:
        start, goal = plain_frame(target), plain_frame(source)
        came_from = {start: start}
        queue = deque([start])
        while queue and goal not in came_from:
            frame = queue.popleft()
            for neighbour in self._neighbours.get(frame, ()):
                if neighbour not in came_from:
                    came_from[neighbour] = frame
                    queue.append(neighbour)
        if goal not in came_from:
            known = ", ".join(self.frames) or "none"
            raise GeometryError(
                f"No transform from {source!r} to {target!r}; frames in the recording's tf: "
                f"{known}. Give the mounting in the robot manifest."
            )
        path = [goal]
        while path[-1] != start:
            path.append(came_from[path[-1]])
        return path[::-1]

    def connects(self, target: str, source: str) -> bool:
        """Whether there is a path between two frames."""
        try:
            self.path(target, source)
        except GeometryError:
            return False
        return True

    def along(self, target: str, source: str) -> list[Edge]:
        """The edges (parent, child) of the path."""
        path = self.path(target, source)
        return [(a, b) if (a, b) in self.edges else (b, a) for a, b in pairwise(path)]

    def is_fixed(self, target: str, source: str) -> bool:
        """Whether no edge of the path moves.

        Raises:
            GeometryError: The frames do not connect.
        """
        return all(isinstance(self.edges[e], FixedEdge) for e in self.along(target, source))

    def poses(self, target: str, source: str, stamps_ns: Stamps) -> Poses:
        """The transforms that carry points of ``source`` into ``target`` at N times.

        Raises:
            GeometryError: The frames do not connect.
        """
        count = stamps_ns.size
        eye = np.repeat(np.eye(3)[None], count, axis=0)
        found = Poses(eye, np.zeros((count, 3)), np.ones(count, np.bool_))
        path = self.path(target, source)
        for near, far in pairwise(path):
            down = self.edges.get((near, far))
            step = down.at(stamps_ns) if down else self.edges[far, near].at(stamps_ns).inverse()
            found = found @ step
        return found

    def lookup(self, target: str, source: str, stamp_ns: int) -> Transform:
        """The transform that carries points of ``source`` into ``target`` at a time.

        Raises:
            GeometryError: The frames do not connect, or an edge between them is not known then.
        """
        if self.is_fixed(target, source):
            changes = self.changes(target, source)
            return changes[bisect_right(changes, stamp_ns, key=_begins) - 1][1]
        poses = self.poses(target, source, np.array([stamp_ns], np.int64))
        if not poses.known[0]:
            raise GeometryError(
                f"No transform from {source!r} to {target!r} at {stamp_ns} ns: tf has a gap there "
                f"or does not reach so far."
            )
        return poses.at(0)

    def changes(self, target: str, source: str) -> list[tuple[int, Transform]]:
        """The transforms of a fixed path and from when each counts; the first from the beginning.

        Raises:
            GeometryError: The frames do not connect, or an edge between them moves.
        """
        if (target, source) not in self._fixed:
            self._fixed[target, source] = self._changes(target, source)
        return self._fixed[target, source]

    def _changes(self, target: str, source: str) -> list[tuple[int, Transform]]:
        edges = [self.edges[edge] for edge in self.along(target, source)]
        if any(isinstance(edge, MovingEdge) for edge in edges):
            raise GeometryError(f"{source!r} moves against {target!r}.")
        times = sorted({int(t) for edge in edges for t in edge.stamps_ns[1:]})
        starts = np.array([np.iinfo(np.int64).min, *times], np.int64)
        poses = self.poses(target, source, starts)
        return [(int(start), poses.at(k)) for k, start in enumerate(starts.tolist())]


def _begins(change: tuple[int, Transform]) -> int:
    return change[0]
