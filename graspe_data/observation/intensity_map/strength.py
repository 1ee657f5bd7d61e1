"""The strength of returns on the scale that the robot manifest declares, or a refusal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import ObservationError
from graspe_data.observation.intensity_map.reach import Histogram, reaches

FAULTY_SHARE = 0.01
"""The most that may be no numbers, and the most that may lie above the declared maximum."""
SMALLER, PLAIN = 0.25, 0.4
"""Shares of the maximum. Clouds that do not reach the first are on a smaller scale; those that
reach beyond the second are on the declared one. Between them lie 0..100 under a maximum of 255, and
a VLP-16, which gives whatever sends no beam back 0..100 of its 255."""
HELD, SUDDEN = 0.25, 0.6
"""Shares of what the first clouds and the last one reached. A cloud that does not tell its scale is
taken where it reaches both: what is seen gets dull by and by, a scale changes at once."""

_KEY = "`lidar.intensity_maximum` of the robot manifest"


class IntensityScale:
    """Whether the clouds of one lidar are on the declared scale, told by all of their returns.

    It is decided over the first clouds together, and held from then on: later clouds may get
    duller, but not at once, nor have fractions where there were whole numbers.
    """

    def __init__(self, maximum: float) -> None:
        """Take R, the greatest value of the declared scale."""
        self._maximum = maximum
        self._first = Histogram(maximum)
        self._reached: tuple[float, float] | None = None
        self._whole = True

    def strength(self, intensity: NDArray[np.float32] | None) -> NDArray[np.float32]:
        """The intensity of a cloud's returns, checked against the declared scale.

        Up to 1 % of the values may be no numbers, or negative: they count as 0. Up to 1 % may lie
        above the maximum, as retro-reflectors do with some drivers: they count as the maximum.

        Args:
            intensity: (N,) on the sensor's own scale; None where the cloud has none.

        Returns:
            float32 (N,), 0..R.

        Raises:
            ObservationError: There is no intensity, or no valid one, or it is on another scale, or
                the clouds so far do not tell.
        """
        values = _usable(intensity, self._maximum)
        seen = Histogram(self._maximum)
        seen.add(values)
        whole = bool((values == np.rint(values)).all())
        if self._reached is None:
            self._decide(seen, whole=whole)
        else:
            self._hold(seen, self._reached, whole=whole)
        return values

    def _decide(self, seen: Histogram, *, whole: bool) -> None:
        self._first += seen
        self._whole &= whole
        reached, maximum = self._first.reach, self._maximum
        if reached < SMALLER * maximum:
            raise ObservationError(
                f"99 % of {self._first.total} intensities are within 0 to {reached:.3g}; expected 0"
                f" to {maximum:g}: the cloud is on a smaller scale, or shows nothing that would "
                f"tell; set {_KEY} to the sensor's greatest value."
            )
        if not reaches(self._first, PLAIN):
            raise ObservationError(
                f"99 % of {self._first.total} intensities are within 0 to {reached:.3g}, and hardly"
                f" one is between that and {maximum:g}: the scale may be 0 to {maximum:g} or a "
                f"smaller one, which cannot be told; set {_KEY} to the sensor's greatest value."
            )
        self._reached = reached, reached

    def _hold(self, seen: Histogram, reached: tuple[float, float], *, whole: bool) -> None:
        first, last = reached
        if seen.reach < max(HELD * first, SUDDEN * last) and not reaches(seen, PLAIN):
            raise ObservationError(
                f"99 % of {seen.total} intensities are within 0 to {seen.reach:.3g}, of the cloud "
                f"before within 0 to {last:.3g}: the driver's scale has changed."
            )
        if self._whole and not whole:
            raise ObservationError(
                "The intensities have fractions, those of earlier clouds were whole numbers: the "
                "driver's scale has changed."
            )
        self._reached = first, seen.reach


def _usable(intensity: NDArray[np.float32] | None, maximum: float) -> NDArray[np.float32]:
    """What a cloud gives, 0..R, where most of it can be."""
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
    # A few faulty numbers count as 0; many are a fault of the driver.
    usable = np.isfinite(intensity) & (intensity >= 0)
    faulty = usable.size - np.count_nonzero(usable)
    if faulty > FAULTY_SHARE * usable.size:
        raise ObservationError(
            f"{faulty} of {usable.size} intensities are NaN, infinite or negative; at most "
            f"{FAULTY_SHARE:.0%} may be: check the driver's intensity field."
        )
    values = intensity if not faulty else np.where(usable, intensity, np.float32(0))
    # The scale: not all 0, and hardly any above the declared greatest value.
    strongest, above = float(values.max()), np.count_nonzero(values > np.float32(maximum))
    if strongest == 0:
        raise ObservationError(
            f"All {values.size} intensities are 0: the driver fills none in. A map of them would "
            f"call every cell free: record with intensity, or leave out `intensity_map`."
        )
    if above > FAULTY_SHARE * values.size:
        raise ObservationError(
            f"{above} of {values.size} intensities are above {maximum:g}, the strongest "
            f"{strongest:g}; expected 0 to {maximum:g}: set {_KEY} to the sensor's greatest value."
        )
    return np.minimum(values, np.float32(maximum))
