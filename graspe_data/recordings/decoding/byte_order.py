"""In which byte order the coordinates of a cloud lie, whatever its message says."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError

# Metres: no lidar reaches farther, and no return is nearer.
_FARTHEST, _NEAREST = 1000.0, 1e-4
# Metres: the farthest that a cloud in millimetres would reach.
_FARTHEST_AS_MM: Final = 1e6
_SAMPLES: Final = 512
# Share of the returns: with more outside the range the order is wrong, with fewer it is right.
_MOSTLY, _HARDLY = 0.5, 0.05


def in_true_order(points: NDArray[np.void], where: str) -> NDArray[np.void]:
    """View points (H, W) in the byte order in which their x, y and z are coordinates.

    The order that the message declares counts, unless most returns lie outside 0.1 mm to 1000 m
    and the other order puts nearly all of them inside.

    Raises:
        RecordingError: In neither order most returns lie within 1000 m.
    """
    step = max(1, points.size // _SAMPLES)
    some = points.reshape(-1)[::step]
    distance = _distances(some)
    if _outside(distance) <= _MOSTLY:
        return points
    if _outside(_distances(some.view(some.dtype.newbyteorder()))) <= _HARDLY:
        return points.view(points.dtype.newbyteorder())
    far = distance[distance > _FARTHEST]
    if len(far) > _MOSTLY * np.count_nonzero(distance):
        raise RecordingError(_absurd(far, int(np.count_nonzero(distance)), where))
    return points


def _distances(points: NDArray[np.void]) -> NDArray[np.float64]:
    """The largest coordinate of each point; 0 for no return."""
    with np.errstate(all="ignore"):
        axes = [np.abs(points[axis].astype(np.float64)) for axis in "xyz"]
    distance = np.maximum(np.maximum(axes[0], axes[1]), axes[2])
    return np.where(np.isfinite(distance), distance, 0.0)


def _outside(distance: NDArray[np.float64]) -> float:
    """Share of the returns that no lidar gives."""
    returns = distance[distance > 0]
    if not len(returns):
        return 0.0
    return float(np.mean((returns > _FARTHEST) | (returns < _NEAREST)))


def _absurd(far: NDArray[np.float64], returns: int, where: str) -> str:
    median = float(np.median(far))
    guess = "The byte order, a field's offset or the driver is wrong."
    if median < _FARTHEST_AS_MM:
        guess = (
            f"Perhaps they are millimetres (the median would be {median / 1000:.1f} m): publish "
            f"metres; they are not converted by guess."
        )
    return (
        f"{where}: of {returns} returns looked at, {len(far)} lie beyond {_FARTHEST:.0f} m, half "
        f"of them beyond {median:.3g} m, in either byte order. {guess}"
    )
