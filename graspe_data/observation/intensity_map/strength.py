"""The strength of returns on the scale that the robot manifest declares, or a refusal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import ObservationError

FAULTY_SHARE = 0.01
"""The most that may be no numbers, and the most that may lie above the declared maximum."""
STEPS = 255
"""A cloud whose strongest return is less than one of these is on another scale."""

_KEY = "`lidar.intensity_maximum` of the robot manifest"


def declared_strength(intensity: NDArray[np.float32] | None, maximum: float) -> NDArray[np.float32]:
    """The intensity of returns, checked against the declared scale.

    Up to 1 % of the values may be no numbers, or negative: they count as 0. Up to 1 % may lie above
    the maximum, as retro-reflectors do with some drivers: they count as the maximum.

    Args:
        intensity: (N,) on the sensor's own scale; None where the cloud has none.
        maximum: R, the greatest value of that scale.

    Returns:
        float32 (N,), 0..maximum.

    Raises:
        ObservationError: There is no intensity, or no valid one, or it is on another scale.
    """
    if intensity is None:
        raise ObservationError(
            "The cloud has no intensity (its fields hold none of intensity, intensities, i, "
            "reflectivity), and an intensity map is made of nothing else: record the field, or "
            "leave out `intensity_map`."
        )
    if intensity.size == 0:
        raise ObservationError(
            "The cloud has no returns within the lidar's range, so nothing is known of "
            "the cells: check the sensor, and `lidar.minimum_range` of the robot manifest."
        )
    usable = np.isfinite(intensity) & (intensity >= 0)
    _check_usable(usable)
    values = intensity if usable.all() else np.where(usable, intensity, np.float32(0))
    _check_scale(values, maximum)
    return np.minimum(values, np.float32(maximum))


def _check_usable(usable: NDArray[np.bool_]) -> None:
    faulty = usable.size - np.count_nonzero(usable)
    if faulty > FAULTY_SHARE * usable.size:
        raise ObservationError(
            f"{faulty} of {usable.size} intensities are NaN, infinite or negative; at most "
            f"{FAULTY_SHARE:.0%} may be: check the driver's intensity field."
        )


def _check_scale(values: NDArray[np.float32], maximum: float) -> None:
    strongest = float(values.max())
    if strongest == 0:
        raise ObservationError(
            f"All {values.size} intensities are 0: the driver fills none in. A map of them would "
            f"call every cell free: record with intensity, or leave out `intensity_map`."
        )
    above = np.count_nonzero(values > np.float32(maximum))
    if above > FAULTY_SHARE * values.size:
        raise ObservationError(
            f"{above} of {values.size} intensities are above {maximum:g}, the strongest "
            f"{strongest:g}; expected 0 to {maximum:g}: set {_KEY} to the sensor's greatest value."
        )
    if strongest * STEPS < maximum:
        raise ObservationError(
            f"The strongest of {values.size} intensities is {strongest:g}, less than 1/{STEPS} of "
            f"{maximum:g}: the cloud is on a smaller scale; set {_KEY} to its greatest value."
        )
