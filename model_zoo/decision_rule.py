"""PAAD's rule for a robot under way: a weighted score, and an alarm that needs several in a row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

DECAY = 0.95


def decision_weights(horizon: int, decay: float = DECAY) -> NDArray[np.float64]:
    """Weights of the steps, (T,), proportional to decay^i: nearer steps count more; they sum to 1.

    Source: tianchenji/PAAD, rosnode/ad_paad.py.
    """
    weights = decay ** np.arange(horizon, dtype=np.float64)
    return np.asarray(weights / weights.sum())


class FailureAlarm:
    """Raised when the weighted probability of failure stays high for some cycles in a row."""

    def __init__(self, horizon: int, threshold: float = 0.5, cycles: int = 3) -> None:
        """Start with no cycles seen.

        Args:
            horizon: Steps predicted, T.
            threshold: A cycle counts when its score is above this.
            cycles: Consecutive cycles that raise the alarm; PAAD runs 10 a second.
        """
        self._weights = decision_weights(horizon)
        self._threshold = threshold
        self._cycles = cycles
        self._high = 0

    def update(self, success: NDArray[np.floating]) -> bool:
        """Take the next cycle's success probabilities (T,); True while the alarm is raised."""
        score = float(self._weights @ (1.0 - success))
        self._high = self._high + 1 if score > self._threshold else 0
        return self._high >= self._cycles

    def clear(self) -> None:
        """Forget the cycles seen: the robot is not driving by itself."""
        self._high = 0
