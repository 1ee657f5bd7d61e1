import numpy as np
import pytest
from pydantic import ValidationError

from graspe_data.arrays import Floats
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.ground import GroundSettings, ground_mesh, make_ground
from graspe_data.simulation.world.world import Ground

ARENA = (-8.0, -5.0, 8.0, 5.0)


def _ground(settings: GroundSettings, seed: int = 1) -> Ground:
    return make_ground(settings, ARENA, np.random.default_rng(seed))


def _hit_heights(ground: Ground, settings: GroundSettings, x: Floats, y: Floats) -> Floats:
    scene = RayScene(ground_mesh(ground, settings))
    origins = np.column_stack([x, y, np.full(len(x), 5.0)])
    down = np.tile([0.0, 0.0, -1.0], (len(x), 1))
    return 5.0 - scene.cast(origins, down).distance.astype(np.float64)


def test_surface_and_heights_agree_at_every_point_of_the_grid() -> None:
    settings = GroundSettings(amplitude=0.2, wavelength=6.0)
    ground = _ground(settings)
    rows, columns = np.indices(ground.heights.shape)[:, 1:-1, 1:-1].reshape(2, -1)
    x = ground.origin[0] + columns.astype(np.float64) * ground.cell
    y = ground.origin[1] + rows.astype(np.float64) * ground.cell
    found = _hit_heights(ground, settings, x + 1e-4, y + 1e-4)
    np.testing.assert_allclose(found, ground.height(x + 1e-4, y + 1e-4), atol=2e-5)
    np.testing.assert_allclose(ground.height(x, y), ground.heights[rows, columns], atol=1e-12)


def test_between_grid_points_the_surface_is_within_a_millimetre_or_two() -> None:
    settings = GroundSettings(amplitude=0.2, wavelength=6.0)
    ground = _ground(settings)
    x, y = np.random.default_rng(0).uniform(-8, 8, (2, 2000))
    assert np.abs(_hit_heights(ground, settings, x, y) - ground.height(x, y)).max() < 0.004


@pytest.mark.parametrize("seed", range(5))
def test_nowhere_higher_than_the_amplitude_nor_steeper_than_15_degrees(seed: int) -> None:
    settings = GroundSettings(amplitude=0.2, wavelength=6.0)
    ground = _ground(settings, seed)
    slope = np.hypot(*np.gradient(ground.heights, ground.cell))
    assert np.abs(ground.heights).max() <= 0.2 + 1e-12
    assert np.degrees(np.arctan(slope.max())) <= 15.0 + 1e-6
    assert max(np.abs(ground.heights).max() / 0.2, slope.max() / np.tan(np.radians(15))) > 0.999


def test_wavelength_says_how_far_hills_are_apart() -> None:
    def crossings(wavelength: float) -> float:
        settings = GroundSettings(amplitude=0.05, wavelength=wavelength)
        middle = _ground(settings).heights[60:-60, 60:-60]
        return float((np.diff(np.sign(middle), axis=1) != 0).mean())

    assert crossings(2.0) > 2 * crossings(8.0) > 0


def test_it_is_flat_at_the_edge_and_beyond() -> None:
    settings = GroundSettings(amplitude=0.3, wavelength=12.0)
    ground = _ground(settings)
    border = [ground.heights[0], ground.heights[-1], ground.heights[:, 0], ground.heights[:, -1]]
    np.testing.assert_allclose(np.concatenate(border), 0.0, atol=1e-12)
    far = np.array([60.0, 100.0, -100.0])
    np.testing.assert_allclose(_hit_heights(ground, settings, far, far), 0.0, atol=1e-5)


def test_without_amplitude_it_is_a_plane() -> None:
    assert not _ground(GroundSettings(cover="floor", amplitude=0.0, wavelength=1.0)).heights.any()


def test_too_steep_is_refused_with_the_wavelength_that_would_do() -> None:
    with pytest.raises(ValidationError, match=r"steeper than 15 degrees.*expected at least 7.0 m"):
        GroundSettings(amplitude=0.3, wavelength=5.0)


def test_a_cell_too_coarse_for_the_waves_is_refused() -> None:
    with pytest.raises(ValidationError, match="cell of at most a quarter"):
        GroundSettings(amplitude=0.02, wavelength=2.0, cell=1.0)
