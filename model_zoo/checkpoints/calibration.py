"""Temperature scaling: one number that makes probabilities mean what they say.

C. Guo, G. Pleiss, Y. Sun, K. Q. Weinberger, "On Calibration of Modern Neural Networks", ICML 2017,
section 4.2, in its binary form: p = sigmoid(z / temperature), with the temperature that minimises
the cross-entropy on validation data. Ranks, and with them AU-ROC, do not change.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings

COLDEST, HOTTEST = 0.25, 10.0
"""Between them a temperature is fitted. Colder ones make most probabilities 0 or 1 in float32."""
FEWEST_ROWS = 10
"""With a failing step, and with a succeeding one. On drawn trajectories whose steps fail together,
nine of ten temperatures fitted on 10 failing rows lie within 26 % of the one fitted on many, on 5
within 60 %, on one anywhere from 0.05 to 1.9 times."""
_COLDEST_STORED, _HOTTEST_STORED = 0.05, 20.0
_HALVINGS = 60

Count = Annotated[int, Field(ge=0)]


class TemperatureScaling(Settings):
    """How logits become probabilities.

    Attributes:
        method: Named, beside that of :class:`Uncalibrated`.
        temperature: Logits are divided by it; above 1 the model was too sure of itself.
        at_bound: Whether the fit ended at the coldest or hottest temperature that is allowed, so
            that the labels follow from the logits' signs, or have nothing to do with them.
        judged: Steps that it was fitted on.
        failing_rows: Rows among them with a failing step; None in checkpoints of former versions.
        loss_before: Mean cross-entropy of these steps without it, nats.
        loss_after: The same with it.
    """

    method: Literal["temperature"] = "temperature"
    temperature: Annotated[float, Field(ge=_COLDEST_STORED, le=_HOTTEST_STORED)]
    at_bound: bool = False
    judged: Annotated[int, Field(ge=1)]
    failing_rows: Count | None = None
    loss_before: float
    loss_after: float

    def __str__(self) -> str:
        """The temperature, for people."""
        bound = ", the bound" if self.at_bound else ""
        return f"temperature {self.temperature:.3f}{bound}"


class Uncalibrated(Settings):
    """Why logits are taken as they are.

    Attributes:
        method: Named, beside that of :class:`TemperatureScaling`.
        reason: What the validation rows lack.
    """

    method: Literal["none"] = "none"
    reason: str

    def __str__(self) -> str:
        """That there is none, for people."""
        return f"not calibrated: {self.reason}"


def fit_temperature(
    logits: ArrayLike, success: ArrayLike, mask: ArrayLike
) -> TemperatureScaling | Uncalibrated:
    """Fit the temperature; the loss is convex in its reciprocal, so bisection finds the minimum.

    Args:
        logits: (N, T), log-odds of success on validation rows.
        success: (N, T), 1 = success.
        mask: (N, T), true where the step is judged.

    Returns:
        A temperature within 0.25 .. 10; or none, where fewer than 10 rows have a failing step or
        fewer than 10 a succeeding one, since so few can give any temperature.

    Raises:
        ZooError: No step is judged, or a logit is not finite.
    """
    judged, wins = np.asarray(mask, dtype=bool), np.asarray(success, dtype=bool)
    z = _finite(np.asarray(logits, dtype=np.float64)[judged])
    y = wins[judged].astype(np.float64)
    # So few rows of a class can give any temperature.
    failing, succeeding = (int((rows & judged).any(axis=-1).sum()) for rows in (~wins, wins))
    if min(failing, succeeding) < FEWEST_ROWS:
        reason = (
            f"{failing} validation rows have a failing step and {succeeding} a succeeding one, "
            f"expected {FEWEST_ROWS} of each"
        )
        return Uncalibrated(reason=reason)
    temperature = _minimum(z, y)
    return TemperatureScaling(
        temperature=temperature,
        at_bound=temperature in (COLDEST, HOTTEST),
        judged=z.size,
        failing_rows=failing,
        loss_before=_cross_entropy(z, y),
        loss_after=_cross_entropy(z / temperature, y),
    )


def _finite(z: NDArray[np.float64]) -> NDArray[np.float64]:
    if not z.size:
        raise ZooError("calibration: no step of the validation rows is judged. Check the split.")
    if not np.isfinite(z).all():
        raise ZooError("calibration: the model's logits are not finite: it has diverged.")
    return z


def _minimum(z: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """The temperature of the least loss; a bound where the loss falls towards it."""
    # The scale is 1 / temperature. The loss is convex in it, so its slope has one zero at most;
    # a slope of one sign from bound to bound has none.
    if _slope(z, y, 1 / COLDEST) <= 0:
        return COLDEST
    if _slope(z, y, 1 / HOTTEST) >= 0:
        return HOTTEST
    # Bisection between the bounds, on the logarithm of the scale.
    low, high = np.log(1 / HOTTEST), np.log(1 / COLDEST)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        falling = _slope(z, y, np.exp(middle)) < 0
        low, high = (middle, high) if falling else (low, middle)
    return float(np.clip(np.exp(-(low + high) / 2), COLDEST, HOTTEST))


def _slope(z: NDArray[np.float64], y: NDArray[np.float64], scale: float) -> float:
    """Of the loss over the factor on the logits."""
    return float(np.mean((np.exp(-np.logaddexp(0, -scale * z)) - y) * z))


def _cross_entropy(z: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    return float(np.mean(np.logaddexp(0, z) - y * z))
