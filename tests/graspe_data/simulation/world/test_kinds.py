"""Surfaces stand where the obstacles say, as high as they say, on the ground."""

from typing import Any

import numpy as np
import pytest

from graspe_data.arrays import Floats
from graspe_data.manifest import validate
from graspe_data.simulation.ray_scene import Hits, RayScene
from graspe_data.simulation.world.build_world import build_world
from graspe_data.simulation.world.kinds.plan_feature import plan_feature
from graspe_data.simulation.world.materials import MATERIAL_NAMES
from graspe_data.simulation.world.placement import place_features
from graspe_data.simulation.world.settings import WorldSettings
from graspe_data.simulation.world.shapes.balls import ball
from graspe_data.simulation.world.world import Ground, World

EVERY_KIND: list[dict[str, Any]] = [
    {"kind": "tree", "per_100_m2": [1, 2]},
    {"kind": "hanging_leaves", "per_100_m2": [1, 2]},
    {"kind": "bush", "per_100_m2": [1, 2]},
    {"kind": "tall_grass", "per_100_m2": [0.5, 1]},
    {"kind": "tall_grass", "within": [-9, -9, -7, -5]},
    {"kind": "vine", "per_100_m2": [1, 2]},
    {"kind": "rock", "per_100_m2": [1, 2]},
    {"kind": "boulder", "per_100_m2": [0.5, 1]},
    {"kind": "stump", "per_100_m2": [1, 2]},
    {"kind": "mud", "per_100_m2": [0.5, 1]},
    {"kind": "water", "per_100_m2": [0.5, 1]},
    {"kind": "litter", "per_100_m2": [0.5, 1]},
    {"kind": "paint", "per_100_m2": [0.5, 1]},
    {"kind": "ditch", "lines": [[[-9, -3], [-9, 3]]]},
    {"kind": "fence", "per_100_m2": [0.5, 1]},
    {"kind": "wall", "lines": [[[-9, 9], [9, 9]]]},
    {"kind": "doorway", "lines": [[[8, -9], [8, 8]]]},
    {"kind": "glass_wall", "lines": [[[5, -9], [7, -7]]]},
    {"kind": "pillar", "at": [[6, 6], [5, -5]]},
    {"kind": "curtain", "lines": [[[4, -9], [4, -7]]]},
    {"kind": "curtain", "lines": [[[3, -9], [3, -7]]], "strands": "strings"},
    {"kind": "ceiling"},
    {"kind": "treeline"},
]


def _settings(*features: dict[str, Any], **more: Any) -> WorldSettings:
    given = {"length": 20, "width": 20, "clearance": 0.4, "features": list(features), **more}
    return validate(given, WorldSettings, "here")


def _flat(*features: dict[str, Any]) -> World:
    ground = {"amplitude": 0.0, "cell": 1.0}
    return build_world(_settings(*features, start=[-8, 0, 0], ground=ground), "tried", 3)


def _cast(world: World, origin: list[float], direction: list[float]) -> Hits:
    return RayScene(world.surfaces).cast(np.array([origin]), np.array([direction]))


def _seen(world: World, origin: list[float], direction: list[float]) -> tuple[str, float]:
    hits = _cast(world, origin, direction)
    return MATERIAL_NAMES[hits.material[0]], round(float(hits.distance[0]), 4)


@pytest.mark.parametrize("feature", EVERY_KIND, ids=lambda feature: feature["kind"])
def test_a_plan_says_how_many_triangles_it_will_make(feature: dict[str, Any]) -> None:
    settings = _settings(feature)
    ground = Ground(np.zeros((2, 2)), (-50.0, -50.0), 100.0)
    spots = place_features(settings, "tried", 4).get(0)
    if spots is None:
        spots = place_features(_settings({"kind": "rock", "at": [[3, 3]]}), "tried", 0)[0]
    plan = plan_feature(
        settings.features[0], spots, ground, settings.arena, np.random.default_rng(1)
    )
    meshes = list(plan.make())
    assert plan.triangles == sum(len(mesh.faces) for mesh in meshes)
    assert (plan.triangles == 0) == (feature["kind"] == "ditch")  # Its surface is the ground's.
    for mesh in meshes:
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.size == 0 or mesh.faces.max() < len(mesh.vertices)


def test_all_kinds_stand_in_one_world_on_uneven_ground() -> None:
    world = build_world(_settings(*EVERY_KIND), "tried", 5)
    names = {MATERIAL_NAMES[index] for index in np.unique(world.surfaces.material)}
    assert names == set(MATERIAL_NAMES) - {"soil", "gravel", "floor"}
    assert len(world.obstacles.material) > 20


def test_a_trunk_stands_on_its_obstacle() -> None:
    world = _flat({"kind": "tree", "at": [[0, 0]], "radius": [0.25, 0.25]})
    material, distance = _seen(world, [-3, 0, 0.05], [1, 0, 0])
    assert material == "bark"
    assert distance == pytest.approx(3 - 0.25, abs=0.01)
    assert world.obstacles.radius.tolist() == [0.25]
    assert world.obstacles.having("stops").material == ("bark",)


def test_a_rock_is_as_high_as_its_obstacle_is_strong() -> None:
    places = [[x, y] for x in (-3, 0, 3) for y in (-3, 0, 3)]
    world = _flat({"kind": "rock", "at": places})
    scene = RayScene(world.surfaces)
    grid = np.stack(np.meshgrid(*[np.linspace(-0.25, 0.25, 101)] * 2), -1).reshape(-1, 2)
    for place, height in zip(places, world.obstacles.strength, strict=True):
        origins = np.column_stack([grid + place, np.full(len(grid), 1.0)])
        hits = scene.cast(origins, np.tile([0.0, 0.0, -1.0], (len(grid), 1)))
        assert 1 - hits.distance.min() == pytest.approx(height, abs=0.004)


def test_a_boulder_stops_though_it_is_rock() -> None:
    obstacles = _flat({"kind": "boulder", "at": [[0, 0]]}).obstacles
    assert obstacles.material == ("rock",)
    assert len(obstacles.having("stops").material) == 1


def test_a_wall_ends_where_its_line_ends_and_so_do_its_capsule() -> None:
    world = _flat(
        {"kind": "wall", "lines": [[[0, -2], [0, 2]]], "height": [2, 2], "thickness": 0.3}
    )
    assert _seen(world, [-3, 1.99, 1.99], [1, 0, 0]) == ("concrete", 2.85)
    for beside in ([-3, 2.01, 1.0], [-3, 0, 2.01]):
        assert np.isinf(_cast(world, beside, [1, 0, 0]).distance[0])
    np.testing.assert_allclose(world.obstacles.start, [[0, -1.85]])
    np.testing.assert_allclose(world.obstacles.end, [[0, 1.85]])


def test_a_door_is_open_over_its_gap_and_its_height() -> None:
    door = {"kind": "doorway", "lines": [[[0, -3], [0, 3]]], "height": [3, 3]}
    world = _flat({**door, "gap": [1, 1], "position": [0.5, 0.5], "door_height": [2, 2]})

    def open_at(y: float, z: float) -> bool:
        return bool(np.isinf(_cast(world, [-3, y, z], [1, 0, 0]).distance[0]))

    assert all(open_at(y, z) for y in (-0.49, 0.0, 0.49) for z in (0.1, 1.99))
    assert not any(open_at(y, z) for y, z in ((-0.51, 1.0), (0.51, 1.0), (0.0, 2.01)))
    edges = np.sort(np.abs(np.concatenate([world.obstacles.start, world.obstacles.end])[:, 1]))
    np.testing.assert_allclose(edges[:2] - world.obstacles.radius[0], 0.5)


def test_a_pane_is_a_single_sheet() -> None:
    world = _flat({"kind": "glass_wall", "lines": [[[0, -3], [0, 3]]], "frame_every": None})
    assert _seen(world, [-3, 0.3, 1], [1, 0, 0]) == ("glass", 3.0)
    assert np.isinf(_cast(world, [0.001, 0.3, 1], [1, 0, 0]).distance[0])


def test_a_frame_stands_every_few_metres() -> None:
    pane = {"kind": "glass_wall", "lines": [[[0, -3], [0, 3]]], "frame_every": 2}
    y = np.linspace(-2.999, 2.999, 3000)
    origins = np.column_stack([np.full(3000, -3.0), y, np.ones(3000)])
    hits = RayScene(_flat(pane).surfaces).cast(origins, np.tile([1.0, 0, 0], (3000, 1)))
    framed = hits.material == MATERIAL_NAMES.index("pillar")
    assert np.count_nonzero(np.diff(framed.astype(int)) == -1) == 3
    assert framed.mean() == pytest.approx(4 * 0.05 / 6, abs=0.002)


@pytest.mark.parametrize("strands", ["beads", "strings"])
def test_a_curtain_lets_most_rays_pass_and_the_robot_too(strands: str) -> None:
    curtain = {"kind": "curtain", "strands": strands, "lines": [[[0, -2], [0, 2]]]}
    world = _flat({**curtain, "spacing": [0.04, 0.04]})
    generator = np.random.default_rng(0)
    places = generator.uniform((-1.9, 0.3), (1.9, 1.9), (5000, 2))
    origins = np.column_stack([np.full(5000, -1.0), places])
    met = RayScene(world.surfaces).blocked(origins, np.tile([1.0, 0, 0], (5000, 1)), 2.0).mean()
    width = {"beads": 0.009, "strings": 0.0054}[strands]
    assert met == pytest.approx(width / 0.04, abs=0.05)
    assert len(world.obstacles.having("free").material) == 1


def test_leaves_hang_between_their_bottom_and_their_top() -> None:
    world = _flat({"kind": "hanging_leaves", "at": [[0, 0]], "bottom": [0.7, 0.7], "top": [2, 2]})
    surfaces = world.surfaces
    leaves = surfaces.material == MATERIAL_NAMES.index("hanging_leaf")
    heights = surfaces.vertices[surfaces.faces[leaves].ravel()][:, 2]
    assert heights.min() == pytest.approx(0.7, abs=0.06)
    assert heights.max() == pytest.approx(2.0, abs=0.15)
    assert len(world.obstacles.having("free").material) == 1


def test_dense_grass_slows_more_than_sparse() -> None:
    def share(density: float) -> float:
        grass = {"kind": "tall_grass", "at": [[0, 0]], "height": [1, 1]}
        world = _flat({**grass, "leaf_area_density": [density, density]})
        return float(world.obstacles.strength[0])

    assert share(0.5) == pytest.approx(np.exp(-0.35 * 0.5))
    assert share(0.5) > share(1.5) > share(20.0) == 0.2


@pytest.mark.parametrize("kind", ["tree", "bush", "rock", "pillar", "vine", "tall_grass"])
def test_everything_stands_on_the_height_of_the_ground(kind: str) -> None:
    world = build_world(_settings({"kind": kind, "at": [[4, 3], [-4, 5], [6, -6]]}), "tried", 6)
    feature = {"tree": "bark", "tall_grass": "grass"}.get(kind, kind)
    mine = world.surfaces.material == MATERIAL_NAMES.index(feature)
    corners: Floats = world.surfaces.vertices[world.surfaces.faces[mine].ravel()].astype(float)
    above = corners[:, 2] - world.ground.height(corners[:, 0], corners[:, 1])
    assert -0.35 < above.min() < 0.45
    assert (np.abs(above) < 0.6).sum() > 0


@pytest.mark.parametrize("finer", [0, 1, 2])
def test_a_ball_is_closed_and_faces_outwards(finer: int) -> None:
    corners, faces = ball(finer)
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1]) == {2}
    a, b, c = corners[faces].transpose(1, 0, 2)
    assert np.all(np.einsum("nk,nk->n", np.cross(b - a, c - a), a + b + c) > 0)
    assert len(faces) == 8 * 4**finer


@pytest.mark.parametrize("kind", [kind["kind"] for kind in EVERY_KIND if "per_100_m2" in kind])
def test_none_of_a_kind_is_no_error(kind: str) -> None:
    world = build_world(_settings({"kind": kind, "per_100_m2": [0, 0]}), "tried", 1)
    assert world.obstacles.material == ()


@pytest.mark.parametrize("kind", ["tree", "hanging_leaves", "bush", "tall_grass", "vine"])
def test_plants_may_be_bare(kind: str) -> None:
    bare = {"kind": kind, "at": [[4, 4]], "leaf_area_density": [0, 0]}
    assert len(build_world(_settings(bare), "tried", 1).obstacles.material) == 1
