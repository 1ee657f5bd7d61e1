"""The rings of a cloud that does not name them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SAMPLE = 8192
_NEAREST = 0.5
_STEEPEST = 1.5
_HEIGHTS = np.arange(-30, 31) / 100
_FINEST, _COARSEST = 0.001, 0.004
_SHARP = 1.5
_MOST_RINGS = 256
_LEAST_SUPPORT = 6
_LOOSE = 0.25
_EXPLAINED = 0.99
_FAIR_SHARE = 0.05


def recover_rings(xyz: NDArray[np.float32], rings: int | None = None) -> NDArray[np.uint16]:
    """Number the rings of a spinning lidar from below to above, by the geometry alone.

    A laser that spins sweeps a cone: over the horizontal range rho its returns lie on one line,
    z = height + slope rho, whatever they hit. A Hough transform over heights and slopes finds the
    lines one by one, the best supported first. Lasers of one sensor may start at different
    heights, as the two blocks of an HDL-64E do.

    Args:
        xyz: Points (N, 3), metres, in the lidar's own frame, its axis z; not corrected for motion.
        rings: How many there are at most; None if not known.

    Returns:
        uint16 (N,); a point between two lines belongs to the nearer. Where there are no lines, as
        in the cloud of a lidar that does not spin, the numbers mean nothing, but they still do
        not depend on the order of the points.
    """
    x, y, z = np.ascontiguousarray(xyz.T)
    rho = np.sqrt(x * x + y * y)
    lines = _find_lines(*_sampled(rho, z), rings or _MOST_RINGS)
    ring = np.zeros(len(xyz), np.uint16)
    for height, slope in ((lines[:-1] + lines[1:]) / 2).astype(np.float32):
        ring += z > height + slope * rho
    return ring


def _sampled(rho: NDArray[np.float32], z: NDArray[np.float32]) -> tuple[Floats, Floats]:
    """Nearness 1 / rho and elevation z / rho of some thousand points, in whatever order they came.

    In these, z = height + slope rho reads elevation = slope + height nearness.
    """
    useful = (rho >= _NEAREST) & (np.abs(z) < np.float32(_STEEPEST) * rho)
    pairs = np.stack((z[useful], rho[useful]), axis=1).view(np.uint64)[:, 0]
    pairs.sort()
    step = max(1, -(-len(pairs) // _SAMPLE))
    some = pairs[::step].copy().view(np.float32).reshape(-1, 2).astype(np.float64)
    return 1 / some[:, 1], some[:, 0] / some[:, 1]


def _find_lines(nearness: Floats, elevation: Floats, most: int) -> Floats:
    """Lines (L, 2) of height and slope, from below to above at the median range.

    One height for all is the simplest explanation and tried first. Where it falls short, the
    heights that carry several lines are tried together.
    """
    if len(nearness) == 0:
        return np.zeros((1, 2))
    votes, best = _sharpest(nearness, elevation)
    lines, support = _pursue(votes.only(np.array([best])), most)
    if support.sum() < _EXPLAINED * len(nearness):
        frequent = _frequent(votes.heights, *_pursue(votes, most))
        others, their_support = _pursue(votes.only(frequent), most)
        if their_support.sum() > support.sum():
            lines = others
    reference = float(np.median(nearness))
    return lines[np.argsort(lines[:, 1] + lines[:, 0] * reference, kind="stable")]


@dataclass(frozen=True)
class _Votes:
    """A Hough transform: ``counts`` (heights, slopes) of the points that see a slope from a height.

    ``bins`` (heights, N): the slope each point voted for.
    """

    nearness: Floats
    elevation: Floats
    heights: Floats
    width: float
    bins: NDArray[np.int32]
    counts: NDArray[np.int64]

    def only(self, rows: NDArray[np.int64]) -> _Votes:
        """The votes from some of the heights."""
        return replace(
            self, heights=self.heights[rows], bins=self.bins[rows], counts=self.counts[rows]
        )


def _frequent(heights: Floats, lines: Floats, support: NDArray[np.int64]) -> NDArray[np.int64]:
    """The heights whose lines explain a fair share of the points; all if none does."""
    nearest = np.abs(np.subtract.outer(lines[:, 0], heights)).argmin(axis=1)
    share = np.bincount(nearest, support, minlength=len(heights))
    frequent = np.flatnonzero(share >= _FAIR_SHARE * support.sum())
    return frequent if len(frequent) else np.arange(len(heights))


def _vote(nearness: Floats, elevation: Floats, heights: Floats, width: float) -> _Votes:
    slopes = elevation - np.multiply.outer(heights, nearness)
    bins = ((slopes - slopes.min()) / width).astype(np.int32)
    columns = int(bins.max()) + 2
    cells = bins + columns * np.arange(len(heights), dtype=np.int32)[:, None]
    counts = np.bincount(cells.ravel(), minlength=columns * len(heights))
    return _Votes(nearness, elevation, heights, width, bins, counts.reshape(-1, columns))


def _sharpest(nearness: Floats, elevation: Floats) -> tuple[_Votes, int]:
    """Votes in the finest bins that still hold most of a line, and the height with most lines.

    Wider bins hold more squared votes only where lines are blurred.
    """
    votes = _vote(nearness, elevation, _HEIGHTS, _FINEST)
    while True:
        squares = np.square(votes.counts).sum(axis=1)
        best = int(squares.argmax())
        if votes.width >= _COARSEST:
            return votes, best
        wider = _vote(nearness, elevation, _HEIGHTS, 2 * votes.width)
        if np.square(wider.counts[best]).sum() < _SHARP * squares[best]:
            return votes, best
        votes = wider


def _pairs(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Votes for two bins side by side, so that no line is halved by an edge."""
    return counts[:, :-1] + counts[:, 1:]


def _pursue(votes: _Votes, most: int) -> tuple[Floats, NDArray[np.int64]]:
    """Take lines away one by one; return them (L, 2) and how many points each explains."""
    counts, alive = votes.counts.copy(), np.ones(len(votes.nearness), np.bool_)
    lines: list[tuple[float, float]] = []
    supports: list[int] = []
    rows = np.arange(len(votes.heights))[:, None]
    while len(lines) < most:
        pairs = _pairs(counts)
        row, column = divmod(int(pairs.argmax()), pairs.shape[1])
        if pairs[row, column] < max(_LEAST_SUPPORT, 0.05 * float(np.median(supports or [0]))):
            break
        voters = alive & ((votes.bins[row] - column) >> 1 == 0)
        line = _fitted(votes, voters, float(votes.heights[row]))
        distance = np.abs(votes.elevation - line[1] - line[0] * votes.nearness)
        gone = np.flatnonzero(alive & (voters | (distance < 2 * votes.width)))
        np.subtract.at(counts, (rows, votes.bins[:, gone]), 1)
        alive[gone] = False
        lines.append(line)
        supports.append(int(np.count_nonzero(distance[gone] < votes.width)))
    return np.array(lines or [(0.0, 0.0)]), np.array(supports or [0])


def _fitted(votes: _Votes, voters: NDArray[np.bool_], height: float) -> tuple[float, float]:
    """Height and slope fitted to the points near a line; the height is held loosely."""
    slope = float(np.median((votes.elevation - height * votes.nearness)[voters]))
    tilt = 0.0
    for _ in range(3):
        rest = votes.elevation - height * votes.nearness
        near = np.abs(rest - slope - tilt * votes.nearness) < votes.width
        nearness, rest = votes.nearness[near], rest[near]
        if len(rest) == 0:
            break
        spread = nearness - nearness.mean()
        tilt = float((spread * rest).sum() / (np.square(spread).sum() + _LOOSE))
        slope = float(rest.mean() - tilt * nearness.mean())
    return height + tilt, slope
