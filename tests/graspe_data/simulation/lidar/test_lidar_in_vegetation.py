"""The lidar among leaves and blades: attenuation by density, and reliability of the cloud."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.observation.observe import observe_points
from graspe_data.observation.point_reliability import PointReliabilitySettings, point_reliability
from graspe_data.observation.settings import PointObservationSettings
from graspe_data.robot import Mounting
from graspe_data.sensor_data import PointCloud
from graspe_data.simulation.lidar.lidar import Lidar
from graspe_data.simulation.lidar.settings import LidarSettings
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.materials import MATERIALS, MaterialName
from graspe_data.simulation.world.mesh import Mesh, join_meshes, mesh_of
from graspe_data.simulation.world.obstacles import Obstacles
from graspe_data.simulation.world.world import Ground, World

Floats = NDArray[np.float64]
INNER, OUTER = 2.0, 4.0


def lidar(mesh: Mesh, **changed: Any) -> Lidar:
    flat = Ground(np.zeros((2, 2)), (0.0, 0.0), 1.0)
    materials = tuple(MATERIALS.values())
    nowhere = (0.0, 0.0, 0.0)
    world = World(mesh, materials, Obstacles.of([]), flat, (-9.0, -9.0, 9.0, 9.0), nowhere)
    return Lidar(world, RayScene(mesh), LidarSettings.model_validate(changed))


def quads(centre: Floats, first: Floats, second: Floats, material: MaterialName) -> Mesh:
    """Parallelograms about centres (N, 3), spanned by half edges (N, 3)."""
    corners = [centre - first - second, centre + first - second, centre + first + second]
    vertices = np.stack([*corners, centre - first + second], axis=1).reshape(-1, 3)
    faces = np.array([[0, 1, 2], [0, 2, 3]]) + 4 * np.arange(len(centre))[:, None, None]
    return mesh_of(vertices, faces.reshape(-1, 3), material)


def around(count: int, generator: np.random.Generator) -> Floats:
    """Places (N, 2) evenly over the ring between the radii ``INNER`` and ``OUTER``."""
    radius = np.sqrt(generator.uniform(INNER**2, OUTER**2, count))
    angle = generator.uniform(0, 2 * np.pi, count)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def upright_blades(density: float, generator: np.random.Generator) -> Mesh:
    """Blades of random azimuth from z = -2 to 2; one-sided leaf area density in m2/m3."""
    width, height = 0.01, 4.0
    volume = np.pi * (OUTER**2 - INNER**2) * height
    count = round(density * volume / (width * height))
    azimuth = generator.uniform(0, np.pi, count)
    level = np.zeros(count)
    across = 0.5 * width * np.stack([np.cos(azimuth), np.sin(azimuth), level], axis=1)
    up = np.tile([0.0, 0.0, 0.5 * height], (count, 1))
    return quads(np.column_stack([around(count, generator), level]), across, up, "grass")


def spherical_leaves(density: float, generator: np.random.Generator) -> Mesh:
    """Small square leaves of spherical orientation between z = -2 and 2."""
    side, height = 0.03, 4.0
    count = round(density * np.pi * (OUTER**2 - INNER**2) * height / side**2)
    normal, other = generator.normal(size=(2, count, 3))
    first = np.cross(normal, other)
    second = np.cross(normal, first)
    first *= 0.5 * side / np.linalg.norm(first, axis=1, keepdims=True)
    second *= 0.5 * side / np.linalg.norm(second, axis=1, keepdims=True)
    z = generator.uniform(-0.5 * height, 0.5 * height, count)
    return quads(np.column_stack([around(count, generator), z]), first, second, "leaf")


def returned(mesh: Mesh, **changed: Any) -> NDArray[np.void]:
    mounting = Mounting(translation=(0.0, 0.0, 0.0))
    sensor = lidar(mesh, mounting=mounting, faintest_share=0.0, dropout=0.0, **changed)
    here = Transform.identity()
    return sensor.turn(0.0, lambda _: here, np.random.default_rng(0))


@pytest.mark.parametrize("density", [0.25, 0.8])
def test_upright_blades_attenuate_by_beer_lambert(density: float) -> None:
    # A beam at elevation e runs d / cos e through blades that show it 2 / pi cos e of their area.
    points = returned(upright_blades(density, np.random.default_rng(7)), sub_rays=1)
    expected = 1 - np.exp(-2 / np.pi * density * (OUTER - INNER))
    # The same blade is seen by all rings, so that a turn holds about 1000 independent looks.
    assert abs(len(points) / 28_928 - expected) < 4 * np.sqrt(expected * (1 - expected) / 1000)


@pytest.mark.parametrize("density", [0.2, 0.6])
def test_leaves_of_spherical_orientation_attenuate_by_half_their_area(density: float) -> None:
    points = returned(spherical_leaves(density, np.random.default_rng(8)), sub_rays=1)
    level = np.cos(np.radians(2.0 * np.arange(16) - 15.0))
    expected = np.mean(1 - np.exp(-0.5 * density * (OUTER - INNER) / level))
    assert abs(len(points) / 28_928 - expected) < 4 * np.sqrt(expected * (1 - expected) / 8000)


def test_thin_leaves_give_weak_returns_that_mix() -> None:
    leaves = spherical_leaves(0.4, np.random.default_rng(9))
    thin, wide = (returned(leaves, divergence=angle) for angle in (0.0, 0.015))
    assert len(wide) > 1.2 * len(thin)
    assert np.median(wide["intensity"]) < 0.8 * np.median(thin["intensity"])
    assert wide["intensity"].mean() * len(wide) < 1.1 * thin["intensity"].mean() * len(thin)


def room() -> Mesh:
    """Walls of 10 m by 8 m round the robot, 3 m high, with four pillars, and a floor."""
    centres = np.array([[5, 0, 1.5], [-5, 0, 1.5], [0, 4, 1.5], [0, -4, 1.5], [0, 0, 0]])
    first = np.array([[0.0, 4, 0], [0, 4, 0], [5, 0, 0], [5, 0, 0], [5, 0, 0]])
    second = np.array([[0, 0, 1.5]] * 4 + [[0, 4, 0]])
    plates = quads(centres, first, second, "concrete")
    at = np.array([[3.0, y, 1.5] for y in (-3.0, -1.2, 1.2, 3.0)])
    faces = [np.tile(edge, (4, 1)) for edge in ([0.0, 0.2, 0.0], [0.0, 0.0, 1.5])]
    return join_meshes([plates, quads(at, faces[0], faces[1], "pillar")])


def tall_grass(generator: np.random.Generator) -> Mesh:
    """150 leaning blades per m2, 7 mm wide and about 1.1 m high, on soil."""
    reach, count = 9.0, 150 * 18**2
    foot = np.column_stack([generator.uniform(-reach, reach, (count, 2)), np.zeros(count)])
    azimuth = generator.uniform(0, np.pi, count)
    across = 0.0035 * np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(count)], axis=1)
    half = np.column_stack(
        [generator.normal(0, 0.08, (count, 2)), generator.uniform(0.4, 0.7, count)]
    )
    soil = quads(np.zeros((1, 3)), np.array([[60.0, 0, 0]]), np.array([[0, 60.0, 0]]), "soil")
    return join_meshes([soil, quads(foot + half, across, half, "grass")])


def reliability(mesh: Mesh) -> float:
    """r_point of a turn from half a metre above the ground."""
    sensor = lidar(mesh)
    pose = Transform(np.eye(3), np.array([0.0, 0.0, 0.5]))
    points = sensor.turn(0.0, lambda _: pose, np.random.default_rng(0))
    xyz = np.stack([points[axis] for axis in "xyz"], axis=1)
    rings = points["ring"].astype(np.int32)
    cloud = PointCloud(0, "velodyne", xyz, points["intensity"].copy(), rings)
    settings = PointObservationSettings(rings=16, minimum_range=0.45, base_height=0.5)
    observed = observe_points(cloud, sensor.base_from_lidar, settings, seed=0)
    return point_reliability(observed.smoothness, PointReliabilitySettings()).r_point


def test_clouds_are_reliable_between_walls_and_not_in_tall_grass() -> None:
    assert reliability(room()) > 0.9
    assert reliability(tall_grass(np.random.default_rng(3))) < 0.35
