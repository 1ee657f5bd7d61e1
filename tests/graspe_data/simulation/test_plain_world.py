"""Rays in the plain world, against the closed forms of planes, cylinders, boxes and grass."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.simulation.plain_world import (
    GRASS,
    GROUND,
    SKY,
    TRUNK,
    WALL,
    Block,
    Floats,
    Hits,
    Trunk,
    World,
    cast_rays,
    surface_noise,
)

EYE = np.array([0.0, 0.0, 1.0])
same = partial(np.testing.assert_allclose, rtol=1e-12, atol=1e-12)


def directions(azimuth: Floats | float, elevation: Floats | float) -> Floats:
    azimuth, elevation = np.broadcast_arrays(np.atleast_1d(azimuth), elevation)
    level = np.cos(elevation)
    rays = (level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation))
    return np.stack(rays, axis=1)


def cast(world: World, rays: Floats, origin: Floats = EYE, seed: int = 0) -> Hits:
    return cast_rays(world, origin, rays, np.random.default_rng(seed))


@given(st.floats(-np.pi, np.pi), st.floats(0.01, np.pi / 2), st.floats(0.05, 3.0))
def test_the_ground_is_the_height_over_the_sine_away(
    azimuth: float, depression: float, height: float
) -> None:
    hits = cast(World(), directions(azimuth, -depression), np.array([5.0, -7.0, height]))
    np.testing.assert_allclose(hits.distance, height / np.sin(depression), rtol=1e-9)
    assert hits.material.tolist() == [GROUND]


def test_the_sky_is_nowhere() -> None:
    hits = cast(World(), directions(0.3, np.array([0.0, 0.5, np.pi / 2])))
    assert np.isposinf(hits.distance).all()
    assert (hits.material == SKY).all()


def test_a_trunk_is_met_where_its_circle_is() -> None:
    distance, radius = 5.0, 0.4
    azimuth = np.linspace(-0.99, 0.99, 31) * np.arcsin(radius / distance)
    elevation = 0.1
    hits = cast(World(trunks=(Trunk(distance, 0, radius, 4),)), directions(azimuth, elevation))
    chord = np.sqrt(radius**2 - (distance * np.sin(azimuth)) ** 2)
    level = distance * np.cos(azimuth) - chord
    np.testing.assert_allclose(hits.distance, level / np.cos(elevation), rtol=1e-9)
    assert (hits.material == TRUNK).all()


@given(st.floats(-np.pi, np.pi), st.floats(-20, 20), st.floats(-20, 20))
def test_what_a_ray_meets_of_a_trunk_lies_on_its_surface(
    azimuth: float, x: float, y: float
) -> None:
    trunk = Trunk(x, y, 0.5, 3.0)
    ray = directions(azimuth, 0.02)
    hits = cast(World(trunks=(trunk,)), ray)
    if hits.material[0] == TRUNK:
        point = EYE + ray[0] * hits.distance[0]
        assert np.hypot(point[0] - x, point[1] - y) == pytest.approx(0.5, abs=1e-6)
        assert 0 <= point[2] <= 3


@pytest.mark.parametrize(
    ("ray", "what"),
    [
        (directions(np.arcsin(0.4 / 5) + 0.001, 0.0), SKY),
        (directions(np.pi, 0.0), SKY),
        (directions(0.0, np.arctan2(3.01, 4.6)), SKY),
        (directions(0.0, np.arctan2(2.99, 4.6)), TRUNK),
        (directions(0.0, np.arctan2(-0.99, 4.6)), TRUNK),
        (directions(0.0, np.arctan2(-1.01, 4.6)), GROUND),
    ],
    ids=["beside", "behind", "above", "top", "foot", "before"],
)
def test_a_trunk_ends_at_its_sides_top_and_foot(ray: Floats, what: int) -> None:
    hits = cast(World(trunks=(Trunk(5, 0, 0.4, 4),)), ray)
    assert hits.material.tolist() == [what]


def test_a_wall_is_met_at_its_face() -> None:
    wall = Block((4, 5), (-10, 10), 2.0)
    azimuth = np.linspace(-1, 1, 21)
    hits = cast(World(blocks=(wall,)), directions(azimuth, 0.05))
    same(hits.distance, 4 / np.cos(azimuth) / np.cos(0.05))
    assert (hits.material == WALL).all()


@pytest.mark.parametrize(
    ("azimuth", "distance"), [(0.0, 2.0), (np.pi / 2, 3.0), (np.pi, 4.0), (-np.pi / 2, 5.0)]
)
def test_each_face_of_a_room_is_where_it_is(azimuth: float, distance: float) -> None:
    walls = (
        Block((2, 3), (-9, 9), 2.0),
        Block((-9, 9), (3, 4), 2.0),
        Block((-5, -4), (-9, 9), 2.0),
        Block((-9, 9), (-6, -5), 2.0),
    )
    hits = cast(World(blocks=walls), directions(azimuth, 0.0))
    same(hits.distance, distance)


def test_a_wall_is_seen_over_and_its_top_is_met_from_above() -> None:
    wall = World(blocks=(Block((4, 6), (-1, 1), 0.5),))
    over, top, face = -0.01, -np.arctan2(0.5, 5.0), -np.arctan2(0.6, 4.0)
    hits = cast(wall, directions(0.0, np.array([over, top, face])))
    assert hits.material.tolist() == [GROUND, WALL, WALL]
    same(hits.distance[1:], [np.hypot(0.5, 5), np.hypot(0.6, 4)])


def test_the_nearest_surface_hides_the_others() -> None:
    wall = World(blocks=(Block((6, 7), (-2, 2), 3),))
    world = World(trunks=(Trunk(3, 0, 0.5, 4), Trunk(9, 0, 5, 4)), blocks=wall.blocks)
    hits = cast(world, directions(np.array([0.0, 0.2]), 0.0))
    around = 9 * np.cos(0.2) - np.sqrt(25 - (9 * np.sin(0.2)) ** 2)
    same(hits.distance, [2.5, around])
    assert hits.material.tolist() == [TRUNK, TRUNK]
    alone = cast(wall, directions(0.2, 0.0))
    same(alone.distance, 6 / np.cos(0.2))


@pytest.mark.parametrize("depth", [0.2, 1.0, 2.0])
def test_grass_lets_through_what_beer_and_lambert_say(depth: float) -> None:
    count, density = 40_000, 1.5
    world = World(blocks=(Block((2, 2 + depth), (-9, 9), 3.0, grass=True),), density=density)
    hits = cast(world, np.repeat(directions(0.0, 0.0), count, axis=0))
    expected = np.exp(-density * depth)
    error = np.sqrt(expected * (1 - expected) / count)
    assert (hits.material == SKY).mean() == pytest.approx(expected, abs=4 * error)
    inside = hits.distance[hits.material == GRASS]
    assert 2 <= inside.min() < inside.max() < 2 + depth
    short = 1 / density - depth * expected / (1 - expected)
    assert inside.mean() - 2 == pytest.approx(short, abs=4 * inside.std() / np.sqrt(inside.size))


def test_the_way_through_grass_counts_not_its_depth() -> None:
    azimuth, count, depth = 1.0, 40_000, 0.5
    world = World(blocks=(Block((1, 1 + depth), (-50, 50), 3.0, grass=True),), density=2.0)
    hits = cast(world, np.repeat(directions(azimuth, 0.0), count, axis=0))
    expected = np.exp(-2.0 * depth / np.cos(azimuth))
    error = np.sqrt(expected * (1 - expected) / count)
    assert (hits.material == SKY).mean() == pytest.approx(expected, abs=4 * error)


def test_grass_is_around_one_who_stands_in_it() -> None:
    count = 20_000
    world = World(blocks=(Block((-50, 50), (-50, 50), 2.0, grass=True),), density=4.0)
    azimuth = np.linspace(-np.pi, np.pi, count, endpoint=False)
    hits = cast(world, directions(azimuth, 0.0))
    assert (hits.material == GRASS).all()
    assert hits.distance.mean() == pytest.approx(0.25, abs=4 * 0.25 / np.sqrt(count))


def test_a_wall_behind_grass_is_seen_through_it() -> None:
    world = World(blocks=(Block((1, 2), (-9, 9), 3.0, grass=True), Block((3, 4), (-9, 9), 3.0)))
    hits = cast(world, np.repeat(directions(0.0, 0.0), 1000, axis=0))
    assert set(hits.material.tolist()) == {GRASS, WALL}
    same(hits.distance[hits.material == WALL], 3.0)


def test_the_same_draws_give_the_same_hits() -> None:
    world = World(blocks=(Block((1, 2), (-9, 9), 3.0, grass=True),))
    rays = np.repeat(directions(0.0, 0.0), 100, axis=0)
    first, again, other = (cast(world, rays, seed=seed).distance for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_the_texture_is_of_the_place_and_even() -> None:
    points = np.random.default_rng(0).uniform(-50, 50, (50_000, 3))
    grey = surface_noise(points, (0.1,))
    np.testing.assert_array_equal(grey, surface_noise(points, (0.1,)))
    assert 0 <= grey.min() < grey.max() <= 1
    assert grey.mean() == pytest.approx(0.5, abs=0.01)
    assert grey.std() == pytest.approx(np.sqrt(1 / 12), abs=0.01)


def test_the_texture_is_constant_over_a_cell_and_new_in_the_next() -> None:
    corners = np.array([[1.0, 2.0, 3.0], [1.999, 2.999, 3.999], [0.999, 2.0, 3.0]])
    here, beside, over = surface_noise(corners, (1.0,))
    assert here == beside != over
    several = surface_noise(corners, (1.0, 100.0))
    coarse = surface_noise(corners, (100.0,))
    np.testing.assert_allclose(several, (np.array([here, beside, over]) + coarse) / 2)
