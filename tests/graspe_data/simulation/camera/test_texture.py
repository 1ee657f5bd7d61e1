"""The grain of a surface is fixed to it and never finer than a pixel."""

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.simulation.camera.texture import SIZE, Texture, tile_of_noise
from graspe_data.simulation.world.materials import MATERIAL_NAMES, MATERIALS, MaterialName

Rows = NDArray[np.float32]
COUNT = 40_000


def factors(material: MaterialName, points: Rows, pixel: float, up: int = 2) -> Rows:
    normals = np.zeros_like(points)
    normals[:, up] = 1.0
    index = np.full(len(points), MATERIAL_NAMES.index(material), np.uint8)
    width = np.full(len(points), pixel, np.float32)
    return Texture(list(MATERIALS.values())).factor(points, normals, index, width)


@pytest.fixture(scope="module")
def points() -> Rows:
    drawn = np.random.default_rng(3).uniform(-50, 50, (COUNT, 3))
    return drawn.astype(np.float32)


@pytest.mark.parametrize("up", [0, 1, 2])
def test_it_varies_about_the_colour_by_the_contrast(points: Rows, up: int) -> None:
    found = factors("gravel", points, 1e-4, up)
    assert found.mean() == pytest.approx(1.0, abs=0.02)
    assert 0.2 < found.std() / MATERIALS["gravel"].contrast < 0.6


def test_the_same_place_has_the_same_grain(points: Rows) -> None:
    alone = factors("soil", points[:1], 1e-3)
    assert alone[0] == factors("soil", points, 1e-3)[0]


def test_far_away_only_the_coarse_grains_are_left(points: Rows) -> None:
    spreads = [float(factors("gravel", points, width).std()) for width in (1e-4, 0.01, 0.1, 2.0)]
    assert spreads == sorted(spreads, reverse=True)
    assert spreads[-1] == 0.0


def test_neighbours_look_alike_and_strangers_do_not(points: Rows) -> None:
    here, beside = (factors("soil", points + np.float32(d), 1e-3) for d in (0.0, 5e-4))
    away = factors("soil", points + np.float32(3.0), 1e-3)
    assert np.corrcoef(here, beside)[0, 1] > 0.95
    assert abs(np.corrcoef(here, away)[0, 1]) < 0.1


def test_the_noise_repeats_without_a_seam() -> None:
    tile = tile_of_noise(0)
    assert tile.shape == (SIZE, SIZE)
    inner = np.abs(np.diff(tile, axis=1)).mean()
    assert np.abs(tile[:, 0] - tile[:, -1]).mean() == pytest.approx(inner, rel=0.3)
