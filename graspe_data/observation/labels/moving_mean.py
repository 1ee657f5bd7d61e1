"""Means over a sliding window of time, for samples at uneven intervals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats


def moving_mean(
    stamps_ns: NDArray[np.int64], values: Floats, before_s: float, after_s: float
) -> Floats:
    """Mean of the samples around each sample, its own included, in linear time.

    Args:
        stamps_ns: int64 (N,), increasing.
        values: float64 (N, ...), a row per stamp.
        before_s: How far back the window reaches; its ends are included.
        after_s: How far on it reaches.

    Returns:
        float64, of the shape of ``values``.
    """
    first = np.searchsorted(stamps_ns, stamps_ns - round(before_s * 1e9), side="left")
    after = np.searchsorted(stamps_ns, stamps_ns + round(after_s * 1e9), side="right")
    sums = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    count = (after - first).reshape(-1, *[1] * (values.ndim - 1))
    mean: Floats = (sums[after] - sums[first]) / count
    return mean
