"""Beer-Lambert: the share of rays that pass vegetation is exp(-G * density * way) (Ross 1981)."""

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.build_world import build_world
from graspe_data.simulation.world.kinds.bush import Bush
from graspe_data.simulation.world.kinds.tall_grass import TallGrass
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.settings import WorldSettings
from graspe_data.simulation.world.shapes.blades import blades
from graspe_data.simulation.world.shapes.leaves import leaf_area, leaves

RAYS = 20_000
UPRIGHT = 2 / np.pi
SPHERICAL = 0.5


def _passing(mesh: Mesh, origins: Floats, direction: list[float], way: float) -> float:
    directions = np.tile(direction, (len(origins), 1))
    return 1 - float(RayScene(mesh).blocked(origins, directions, way).mean())


def _along_x(y: float, z: tuple[float, float], start: float) -> Floats:
    generator = np.random.default_rng(5)
    places = generator.uniform((-y, z[0]), (y, z[1]), (RAYS, 2))
    return np.column_stack([np.full(RAYS, start), places])


def _feet(per_m2: float, half: float, generator: np.random.Generator) -> Floats:
    flat = generator.uniform(-half, half, (int(per_m2 * (2 * half) ** 2), 2))
    return np.column_stack([flat, np.zeros(len(flat))])


@pytest.mark.parametrize("way", [0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("lean", [0.0, 0.4])
def test_upright_blades_let_pass_what_two_over_pi_says_however_they_lean(
    way: float, lean: float
) -> None:
    generator = np.random.default_rng(3)
    per_m2, width = 150.0, 0.007
    feet = _feet(per_m2, 4.0, generator)
    mesh = blades(feet, np.ones(len(feet)), width, lean, "grass", generator)
    origins = _along_x(3.5, (0.1, 0.5), 0.0)
    origins[:, 0] = generator.uniform(-3.5, 3.5 - way, RAYS)
    found = _passing(mesh, origins, [1.0, 0.0, 0.0], way)
    # 20,000 rays through 9,600 blades: one standard deviation is below 0.5 % of all rays.
    assert found == pytest.approx(np.exp(-UPRIGHT * per_m2 * width * way), abs=0.015)


@pytest.mark.parametrize("direction", [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]])
def test_leaves_of_random_orientation_let_pass_the_same_in_every_direction(
    direction: list[float],
) -> None:
    generator = np.random.default_rng(4)
    density, half, way = 2.0, 2.0, 1.5
    count = int(density * (2 * half) ** 3 / leaf_area(0.07, 0.045))
    centres: NDArray[np.float64] = generator.uniform(-half, half, (count, 3))
    mesh = leaves(centres, 0.07, 0.045, "leaf", generator)
    middle = generator.uniform(-0.9, 0.9, (RAYS, 3)) - np.array(direction) * way / 2
    found = _passing(mesh, middle, direction, way)
    assert found == pytest.approx(np.exp(-SPHERICAL * density * way), abs=0.02)


@pytest.mark.parametrize("density", [0.6, 1.2])
def test_a_field_of_tall_grass_has_the_density_it_was_asked_for(density: float) -> None:
    grass = TallGrass(leaf_area_density=(density, density), height=(1.0, 1.0))
    settings = WorldSettings(
        length=8, width=8, ground={"amplitude": 0, "cell": 1.0}, features=(grass,)
    )
    world = build_world(settings, "tried", 2)
    scene, way = RayScene(world.surfaces), 1.0
    levels = np.linspace(0.025, 0.975, 20)
    depths = []
    for level in levels:
        origins = _along_x(3.0, (level - 0.025, level + 0.025), -way / 2)[:4000]
        east = np.tile([1.0, 0.0, 0.0], (len(origins), 1))
        depths.append(-np.log(1 - scene.blocked(origins, east, way).mean()))
    # Blades end in points, so the density falls with height; its mean is the one asked for.
    assert np.mean(depths) / (UPRIGHT * way) == pytest.approx(density, rel=0.05)
    assert depths[0] > 3 * depths[-1]


def test_a_bush_dims_a_ray_by_the_length_of_its_way_through_the_dome() -> None:
    density, radius, height = 4.0, 0.8, 1.0
    bush = Bush(
        at=((0.0, 0.0),),
        radius=(radius,) * 2,
        height=(height,) * 2,
        leaf_area_density=(density,) * 2,
    )
    settings = WorldSettings(
        length=8, width=8, start=(-3, 0, 0), ground={"amplitude": 0}, features=(bush,)
    )
    shares = []
    expected = []
    for seed in range(10):
        origins = _along_x(0.5, (0.2, 0.6), -2.0)[:2000]
        scene = RayScene(build_world(settings, "tried", seed).surfaces)
        shares.append(1 - scene.blocked(origins, np.tile([1.0, 0, 0], (2000, 1)), 4.0).mean())
        inside = 1 - (origins[:, 1] / radius) ** 2 - (origins[:, 2] / height) ** 2
        chord = 2 * radius * np.sqrt(np.maximum(inside, 0))
        expected.append(np.exp(-SPHERICAL * density * chord).mean())
    # Stems take some more; leaves at the rim stick out of the dome.
    assert np.mean(shares) == pytest.approx(np.mean(expected), abs=0.04)
