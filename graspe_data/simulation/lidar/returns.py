"""From the echoes of a beam to the returns that the sensor reports."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.lidar.settings import LidarSettings, Returns

_FAINTEST_AT: Final = 50.0


def merge_echoes(
    distance: NDArray[np.float32], energy: NDArray[np.float32], pulse_length: float
) -> tuple[Floats, Floats]:
    """Join echoes that the receiver cannot tell apart.

    Echoes less than a pulse's length behind one another come back as one pulse at their mean
    range, weighted by energy, with the sum of their energies.

    Args:
        distance: (N, K), metres, finite.
        energy: (N, K), shares of the full energy, 0 for none.
        pulse_length: Metres.

    Returns:
        Range in metres and energy, each (N, K), by range; both 0 where there is none.
    """
    order = np.argsort(distance, axis=1)
    away = np.take_along_axis(distance, order, axis=1).astype(np.float64)
    strength = np.take_along_axis(energy, order, axis=1).astype(np.float64)
    place = _places(away, pulse_length)
    merged = np.asarray(np.bincount(place, strength.ravel(), distance.size), np.float64)
    moment = np.asarray(np.bincount(place, (strength * away).ravel(), distance.size), np.float64)
    mean: Floats = np.divide(moment, merged, out=np.zeros_like(moment), where=merged > 0)
    return mean.reshape(distance.shape), merged.reshape(distance.shape)


def _places(sorted_distance: Floats, pulse_length: float) -> NDArray[np.intp]:
    """Index (N K,) into the flat (N, K) pulses for each echo: one on where a gap is long."""
    place: NDArray[np.intp] = np.empty(sorted_distance.shape, np.intp)
    place[:, 0] = np.arange(0, place.size, sorted_distance.shape[1])
    place[:, 1:] = np.diff(sorted_distance, axis=1) >= pulse_length
    return np.asarray(np.cumsum(place, axis=1).ravel(), np.intp)


def least_energy(distance: Floats, settings: LidarSettings) -> Floats:
    """Energy that is just detected at ranges in metres; any shape; inf where out of reach.

    The light that comes back falls with the range squared.
    """
    within = (distance >= settings.minimum_range) & (distance <= settings.maximum_range)
    least = settings.faintest_share * np.square(distance / _FAINTEST_AT)
    return np.where(within, least, np.inf)


def choose_returns(energy: Floats, returns: Returns) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Choose which returns of each beam are reported, as a VLP-16 does.

    Of ``dual`` the first is the strongest and the second the last; where these are one, the
    second is the second strongest.

    Args:
        energy: (N, K), by range; 0 where nothing is detected.
        returns: Which.

    Returns:
        Indices (N, R) along K, with R = 2 for ``dual``, else 1, and whether there is such a one.
    """
    rows = np.arange(len(energy))
    # Echoes come in order of distance: the last that has energy is the farthest.
    strongest = energy.argmax(axis=1)
    last = energy.shape[1] - 1 - (energy > 0)[:, ::-1].argmax(axis=1)
    if returns != "dual":
        chosen = last if returns == "last" else strongest
        return chosen[:, None], energy[rows, chosen, None] > 0
    # Two returns: the strongest and the last, or the second strongest where these are one.
    others = energy.copy()
    others[rows, strongest] = 0
    second = np.where(last == strongest, others.argmax(axis=1), last)
    both = np.stack([strongest, second], axis=1)
    present = np.stack([energy[rows, strongest], others[rows, second]], axis=1) > 0
    return both, present
