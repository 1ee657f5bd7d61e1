"""Peaks of intensity along rings, against the detector as it is described, beam by beam."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.errors import PlannerError
from graspe_data.sensor_data import PointCloud
from planners.glass_peaks import PeakSettings, glass_peaks, peaks

Floats = NDArray[np.float64]
SETTINGS = PeakSettings()


def slow_peaks(intensity: Floats, reach: Floats, settings: PeakSettings) -> list[int]:
    """The detector in the words of its fact sheet."""
    found, start = [], None
    for now in range(1, len(intensity)):
        change = intensity[now] - intensity[now - 1]
        if intensity[now] > settings.least and change >= settings.step:
            start = now - 1
        elif change < -settings.step and start is not None:
            width = now - start
            if width <= settings.width and abs(reach[start] - reach[now]) < settings.gate:
                found.append(start + width // 2)
                start = None
    return found


levels = st.sampled_from([0.0, 40.0, 70.0, 119.0, 121.0, 130.0, 190.0, 255.0])


@settings(deadline=None)
@given(st.lists(st.tuples(levels, st.sampled_from([2.0, 2.05, 2.2])), max_size=60))
def test_the_fast_detector_finds_what_the_slow_one_finds(beams: list[tuple[float, float]]) -> None:
    intensity, reach = np.array(beams, np.float64).reshape(-1, 2).T
    assert peaks(intensity, reach, SETTINGS).tolist() == slow_peaks(intensity, reach, SETTINGS)


def test_a_peak_is_found_in_its_middle() -> None:
    intensity = np.array([20, 20, 130, 200, 150, 30, 20], np.float64)
    assert peaks(intensity, np.full(7, 3.0), SETTINGS).tolist() == [3]
    wide = np.array([20.0, *[200.0] * 7, 20.0])
    assert peaks(wide, np.full(9, 3.0), SETTINGS).tolist() == []


def ring_of(strength: Floats, elevation: float, ring: int) -> Floats:
    angle = np.linspace(-0.5, 0.5, len(strength))
    x, y = 3 * np.cos(angle), 3 * np.sin(angle)
    return np.stack((x, y, 0 * x + 3 * np.tan(elevation), strength, 0 * x + ring), axis=1)


def cloud_of(*rows: Floats) -> PointCloud:
    points = np.concatenate(rows).astype(np.float32)
    ring = points[:, 4].astype(np.int32)
    return PointCloud(0, "lidar", points[:, :3], points[:, 3], ring)


def test_only_rings_near_the_horizon_are_looked_at_and_order_does_not_count() -> None:
    strength = np.full(251, 20.0)
    strength[125:128] = 200
    level, steep = ring_of(strength, 0.0, 8), ring_of(strength, 0.2, 14)
    found = glass_peaks(cloud_of(level, steep), 16, SETTINGS)
    assert found == pytest.approx(np.array([[3.0, 0.004 * 3, 0.0]]), abs=0.005)
    mixed = cloud_of(np.random.default_rng(1).permutation(np.concatenate([level, steep])))
    assert glass_peaks(mixed, 16, SETTINGS) == pytest.approx(found)


def test_of_two_returns_of_a_beam_the_nearer_counts() -> None:
    strength = np.full(251, 20.0)
    strength[125:128] = 200
    level = ring_of(strength, 0.0, 8)
    behind = level * (1.5, 1.5, 1.5, 0.0, 1.0) + (0, 0, 0, 90.0, 0)
    assert len(glass_peaks(cloud_of(level, behind), 16, SETTINGS)) == 1


def test_without_intensity_there_is_nothing_to_find() -> None:
    cloud = PointCloud(0, "lidar", np.zeros((0, 3), np.float32), None, None)
    with pytest.raises(PlannerError, match="no intensity"):
        glass_peaks(cloud, 16, SETTINGS)
