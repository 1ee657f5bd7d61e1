"""The sky lights level ground as much as it says."""

import numpy as np
import pytest

from graspe_data.simulation.camera.light import Light, Sky
from graspe_data.simulation.camera.sky import clouds, sky_radiance

UP = np.array([0.0, 0.0, 1.0])


def hemisphere(count: int, seed: int = 0) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    """Directions with a density in proportion to the sine of the elevation."""
    generator = np.random.default_rng(seed)
    z = np.sqrt(generator.uniform(0, 1, count))
    azimuth = generator.uniform(0, 2 * np.pi, count)
    flat = np.sqrt(1 - z * z)
    stacked = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=1)
    return stacked.astype(np.float32)


@pytest.mark.parametrize(("sky", "within"), [("indoor", 0.01), ("overcast", 0.06), ("clear", 0.2)])
def test_the_whole_sky_gives_its_illuminance(sky: Sky, within: float) -> None:
    light = Light(sky, UP, 0.0, 10_000.0)
    # E = integral of L z over the hemisphere = pi times the mean under this density.
    illuminance = np.pi * sky_radiance(hemisphere(40_000), light)[:, 1].mean()
    assert illuminance == pytest.approx(10_000.0, rel=within)


def test_an_overcast_zenith_is_three_times_as_bright_as_the_horizon() -> None:
    light = Light("overcast", UP, 0.0, 1000.0)
    directions = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], np.float32)
    horizon, zenith = sky_radiance(directions, light)[:, 0]
    cloud = 1.0 + clouds(directions)[1] * (1.15 - 0.98) / 0.98
    assert zenith / horizon == pytest.approx(3.0 * cloud, rel=1e-5)


def test_a_clear_sky_is_brightest_at_the_sun_and_blue_elsewhere() -> None:
    light = Light("clear", np.array([0.6, 0.0, 0.8]), 80_000.0, 15_000.0)
    sun, off = sky_radiance(np.array([[0.6, 0, 0.8], [-0.6, 0, 0.8]], np.float32), light)
    assert sun.min() > 5 * off.max()
    assert off[2] > off[0]


def test_below_the_horizon_lies_the_ground() -> None:
    light = Light("clear", UP, 50_000.0, 10_000.0)
    below, above = sky_radiance(np.array([[1, 0, -1e-3], [1, 0, 1e-3]], np.float32), light)
    assert below[1] == pytest.approx(0.15 * 60_000 / np.pi * 0.98, rel=0.05)
    assert above[1] < 3 * below[1]
