"""How strong the returns of clouds are as a whole, whatever a few of them are."""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import NDArray

STRAYS = 3
"""Returns, and 1 % of them where that is more, that say nothing of the scale."""

_BINS = 1024
_SATURATED = 0.95
"""Share of the maximum from which a return may be a reflector that saturates any scale."""
_TAIL, _TAIL_SHARE = 5, 0.0001
"""Different strengths, and the share of all returns, that make a tail rather than strays."""


class Histogram:
    """Counts of returns by strength, of one cloud or of several."""

    def __init__(self, maximum: float) -> None:
        """Take the greatest strength."""
        self.maximum = maximum
        self._counts = np.zeros(_BINS + 1, np.int64)

    def add(self, strength: NDArray[np.float32]) -> None:
        """Add returns (N,), 0..maximum."""
        # Rounded up, so that the upper edge of a bin is no less than what it holds.
        bins = np.ceil(strength * np.float64(_BINS / self.maximum)).astype(np.int64)
        self._counts += np.bincount(np.minimum(bins, _BINS), minlength=_BINS + 1)

    def __iadd__(self, other: Histogram) -> Self:
        """Add the returns of another."""
        self._counts += other._counts
        return self

    @property
    def total(self) -> int:
        """How many returns."""
        return int(self._counts.sum())

    @property
    def reach(self) -> float:
        """The strength that more returns than strays have, or exceed; to a 1024th of the maximum.

        Of very few returns it is the least strength.
        """
        strays = max(STRAYS, self.total // 100)
        from_above = self._counts[::-1].cumsum()
        place = int(np.searchsorted(from_above, min(strays, self.total - 1), side="right"))
        return (_BINS - place) * self.maximum / _BINS

    def has_tail(self, share: float) -> bool:
        """Whether enough returns of different strengths lie between a share and saturation."""
        begin, end = int(np.ceil(share * _BINS)) + 1, int(_SATURATED * _BINS)
        counts = self._counts[begin:end]
        several = int(np.count_nonzero(counts)) >= _TAIL
        return several and int(counts.sum()) > _TAIL_SHARE * self.total


def reaches(histogram: Histogram, share: float) -> bool:
    """Whether strengths beyond a share of the maximum are more than strays that saturate."""
    return histogram.reach > share * histogram.maximum or histogram.has_tail(share)
