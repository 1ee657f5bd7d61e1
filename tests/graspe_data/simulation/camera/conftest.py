"""Small worlds made by hand, of surfaces without grain."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.materials import MATERIALS, Material, MaterialName
from graspe_data.simulation.world.mesh import Mesh, join_meshes, mesh_of
from graspe_data.simulation.world.obstacles import Obstacles
from graspe_data.simulation.world.world import Ground, World

Corners = Sequence[Sequence[float]]
Scenery = tuple[World, RayScene]


def plain(material: Material) -> Material:
    return Material(
        material.colour,
        0.0,
        material.grain,
        material.reflectivity,
        material.effect,
        material.translucency,
        material.transmission,
    )


@pytest.fixture(scope="session")
def quad() -> Callable[[Corners, MaterialName], Mesh]:
    def make(corners: Corners, material: MaterialName) -> Mesh:
        return mesh_of(np.array(corners, float), np.array([[0, 1, 2], [0, 2, 3]]), material)

    return make


@pytest.fixture(scope="session")
def level(quad: Callable[[Corners, MaterialName], Mesh]) -> Callable[..., Mesh]:
    """A level square about (x, y) at a height; ``half`` is half its side."""

    def make(
        material: MaterialName,
        half: float = 100.0,
        at: tuple[float, float] = (0.0, 0.0),
        height: float = 0.0,
    ) -> Mesh:
        (x, y), h = at, half
        corners = [(x - h, y - h), (x + h, y - h), (x + h, y + h), (x - h, y + h)]
        return quad([(*corner, height) for corner in corners], material)

    return make


@pytest.fixture(scope="session")
def upright(quad: Callable[[Corners, MaterialName], Mesh]) -> Callable[..., Mesh]:
    """A plate across x at a distance, between two y and two z."""

    def make(
        material: MaterialName, x: float, y: tuple[float, float], z: tuple[float, float]
    ) -> Mesh:
        corners = [(x, y[0], z[0]), (x, y[1], z[0]), (x, y[1], z[1]), (x, y[0], z[1])]
        return quad(corners, material)

    return make


@pytest.fixture(scope="session")
def scenery() -> Callable[..., Scenery]:
    def make(*meshes: Mesh, grain: bool = False, **changed: Material) -> Scenery:
        named = {str(name): item for name, item in MATERIALS.items()} | changed
        materials = tuple(item if grain else plain(item) for item in named.values())
        surfaces = join_meshes(meshes)
        ground = Ground(np.zeros((2, 2)), (-100.0, -100.0), 200.0)
        arena, start = (-20.0, -20.0, 20.0, 20.0), (0.0, 0.0, 0.0)
        world = World(surfaces, materials, Obstacles.of([]), ground, arena, start)
        return world, RayScene(surfaces)

    return make
