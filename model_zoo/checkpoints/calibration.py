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

_COLDEST, _HOTTEST = 0.05, 20.0
_HALVINGS = 60


class Calibration(Settings):
    """How logits become probabilities.

    Attributes:
        method: The only one there is.
        temperature: Logits are divided by it; above 1 the model was too sure of itself.
        judged: Steps that it was fitted on.
        loss_before: Mean cross-entropy of these steps without it, nats.
        loss_after: The same with it.
    """

    method: Literal["temperature"] = "temperature"
    temperature: Annotated[float, Field(ge=_COLDEST, le=_HOTTEST)]
    judged: Annotated[int, Field(ge=1)]
    loss_before: float
    loss_after: float


def fit_temperature(logits: ArrayLike, success: ArrayLike, mask: ArrayLike) -> Calibration:
    """Fit the temperature; the loss is convex in its reciprocal, so bisection finds the minimum.

    Args:
        logits: (N, T), log-odds of success on validation rows.
        success: (N, T), 1 = success.
        mask: (N, T), true where the step is judged.

    Returns:
        A temperature within 0.05 .. 20, the bounds where the labels follow from the logits' signs
        or have nothing to do with them.

    Raises:
        ZooError: No step is judged, or a logit is not finite.
    """
    judged = np.asarray(mask, dtype=bool)
    z = np.asarray(logits, dtype=np.float64)[judged]
    y = np.asarray(success, dtype=np.float64)[judged]
    if not z.size:
        raise ZooError("calibration: no step of the validation rows is judged. Check the split.")
    if not np.isfinite(z).all():
        raise ZooError("calibration: the model's logits are not finite: it has diverged.")
    low, high = np.log(1 / _HOTTEST), np.log(1 / _COLDEST)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        falling = _slope(z, y, np.exp(middle)) < 0
        low, high = (middle, high) if falling else (low, middle)
    temperature = float(np.clip(np.exp(-(low + high) / 2), _COLDEST, _HOTTEST))
    return Calibration(
        temperature=temperature,
        judged=z.size,
        loss_before=_cross_entropy(z, y),
        loss_after=_cross_entropy(z / temperature, y),
    )


def _slope(z: NDArray[np.float64], y: NDArray[np.float64], scale: float) -> float:
    """Of the loss over the factor on the logits."""
    return float(np.mean((np.exp(-np.logaddexp(0, -scale * z)) - y) * z))


def _cross_entropy(z: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    return float(np.mean(np.logaddexp(0, z) - y * z))
