"""The rings of a cloud that does not name them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats

# Points at most that vote: 64 for each of 128 rings, so that the time does not grow with the cloud.
_SAMPLE = 8192
# Metres: nearer, the noise of the range blurs z / rho, and the robot itself is hit.
_NEAREST = 0.5
# Tangent (56 degrees): steeper returns, which few lidars have, do not vote.
_STEEPEST = 1.5
# Metres: the heights in the lidar's frame at which a laser may start.
_HEIGHTS = np.arange(-30, 31) / 100
# Tangents, widths of a bin: 0.06 degrees, and 0.23, less than lies between rings of an HDL-64E.
_FINEST, _COARSEST = 0.001, 0.004
# Ratio: bins twice as wide hold twice the squared votes of blurred lines, as many of sharp ones.
_SHARP = 1.5
# Rings: as many as a robot manifest may declare.
_MOST_RINGS = 256
# Points: fewer lie on a line by chance.
_LEAST_SUPPORT = 6
# Share of the points of a median line: with fewer it is what others left over.
_LEAST_SHARE = 0.05
# 1/m^2, a ridge on the squared nearness: a height stays where the range hardly varies.
_LOOSE = 0.25
# Share of the points on lines of one height from which on no other height is looked for.
_EXPLAINED = 0.99
# Share of the explained points that a height's lines need, lest every height has some.
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
    # The height of the origin at which most points fall into lines.
    votes, best = _sharpest(nearness, elevation)
    lines, support = _pursue(votes.only(np.array([best])), most)
    # Where that leaves many points, lines of the heights that win most often are tried too.
    if support.sum() < _EXPLAINED * len(nearness):
        frequent = _frequent(votes.heights, *_pursue(votes, most))
        others, their_support = _pursue(votes.only(frequent), most)
        if their_support.sum() > support.sum():
            lines = others
    # From the lowest line up, where the points are.
    reference = float(np.median(nearness))
    return lines[np.argsort(lines[:, 1] + lines[:, 0] * reference, kind="stable")]


@dataclass(frozen=True)
class _Votes:
    """A Hough transform: the slopes that N points vote for from each of H heights.

    ``nearness`` (N,), 1/m. ``elevation`` (N,), a tangent, as slopes are. ``heights`` (H,), metres.
    ``width``: of a bin of slopes, a tangent. ``bins`` (H, N): the bin each point votes for, counted
    from the least slope. ``counts`` (H, S): the votes for each of S bins.
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
        # The fullest pair of neighbouring bins; a line needs as many points as lines usually have.
        pairs = _pairs(counts)
        row, column = divmod(int(pairs.argmax()), pairs.shape[1])
        usual = float(np.median(supports or [0]))
        if pairs[row, column] < max(_LEAST_SUPPORT, _LEAST_SHARE * usual):
            break
        voters = alive & ((votes.bins[row] - column) >> 1 == 0)
        # A line through its voters; they and what lies on it vote no more.
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
