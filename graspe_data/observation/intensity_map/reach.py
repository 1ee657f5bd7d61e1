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
_TAIL = 5
"""Different strengths that make a tail rather than strays."""


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

    def tail(self, share: float) -> int:
        """How many different strengths lie between a share of the maximum and saturation."""
        begin, end = int(np.ceil(share * _BINS)) + 1, int(_SATURATED * _BINS)
        return int(np.count_nonzero(self._counts[begin:end]))


def reaches(histogram: Histogram, share: float) -> bool:
    """Whether strengths beyond a share of the maximum are more than strays that saturate."""
    return histogram.reach > share * histogram.maximum or histogram.tail(share) >= _TAIL
