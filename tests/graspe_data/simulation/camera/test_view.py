"""Surfaces, shadows and glass have the radiance that photometry gives them."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.simulation.camera.light import Light
from graspe_data.simulation.camera.view import Seen, View
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.materials import MATERIALS
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.world import World

UP = np.array([0.0, 0.0, 1.0])
INDOOR = Light("indoor", UP, 0.0, 400.0)
SUN = np.array([0.6, 0.0, 0.8])
CLEAR = Light("clear", SUN, 50_000.0, 12_000.0)
HAZE = 1 / 600
Make = Callable[..., Mesh]
Scene = Callable[..., tuple[World, RayScene]]
PIXEL = 0.004


def look_at(
    scenery: tuple[World, RayScene], light: Light, origin: tuple[float, ...], targets: Any
) -> Seen:
    start = np.array(origin, np.float32)
    ahead: NDArray[np.float32] = np.asarray(targets, np.float32) - start
    unit = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    return View(*scenery, light).look(start, unit, 0.05, PIXEL)


def test_level_ground_is_as_bright_as_lamberts_law_says(level: Make, scenery: Scene) -> None:
    seen = look_at(scenery(level("concrete")), CLEAR, (0, 0, 1), [(1, 0, 0), (0, -2, 0)])
    bare = 0.39 / np.pi * (50_000 * 0.8 * 1.0 + 12_000 * 0.98)
    air = 0.5 * CLEAR.level_lux / np.pi
    clear = np.exp(-HAZE * seen.distance)
    assert seen.distance == pytest.approx([np.sqrt(2), np.sqrt(5)], rel=1e-5)
    assert seen.radiance[:, 1] == pytest.approx(bare * clear + air * (1 - clear), rel=1e-4)


def test_the_shadow_of_a_plate_falls_where_the_sun_sends_it(level: Make, scenery: Scene) -> None:
    plate = level("wood", half=0.5, at=(0.0, 0.0), height=1.6)
    # The sun stands at 0.6 : 0.8, so a height of 1.6 m throws the shadow 1.2 m towards -x.
    x = np.linspace(-2.5, 0.5, 301) + 5e-3
    targets = [(at, 0.0, 0.0) for at in x]
    seen = look_at(scenery(level("soil"), plate), CLEAR, (-1.0, -4.0, 1.0), targets)
    shadow = seen.radiance[:, 1] < 0.5 * seen.radiance[:, 1].max()
    assert (shadow == (np.abs(x + 1.2) < 0.5)).all()


def test_a_shadow_leaves_the_skys_light(level: Make, scenery: Scene) -> None:
    plate = level("wood", half=0.5, height=1.6)
    spots = [(-1.2, 0, 0), (3, 0, 0)]
    dark, lit = look_at(scenery(level("soil"), plate), CLEAR, (0, -4, 1), spots).radiance[:, 1]
    air = 0.5 * CLEAR.level_lux / np.pi * HAZE * 4.3
    assert (dark - air) / (lit - air) == pytest.approx(11_760 / (40_000 + 11_760), rel=0.03)


def test_a_leaf_lets_the_sun_through_and_a_board_does_not(level: Make, scenery: Scene) -> None:
    leaf, board = (level(name, half=0.2, height=1.0) for name in ("leaf", "wood"))
    noon = Light("clear", UP, 50_000.0, 0.0)
    for sheet, name, share in ((leaf, "leaf", 0.25), (board, "wood", 0.0)):
        seen = look_at(scenery(sheet), noon, (0, 0, 0), [(0.05, 0.02, 1)])
        below = MATERIALS[name].colour[1] / np.pi * (50_000 * share + 0.15 * 50_000)  # type: ignore[index]
        own = seen.radiance[0, 1] / below
        assert own == pytest.approx(1.0, rel=0.35 if name == "leaf" else 0.05)


def test_overcast_shade_is_softer_than_a_suns(level: Make, scenery: Scene) -> None:
    dull = Light("overcast", UP, 0.0, 10_000.0)
    plate = level("wood", half=0.5, height=1.0)
    under, free = look_at(
        scenery(level("soil"), plate), dull, (0, -4, 0.5), [(0, 0, 0), (3, 0, 0)]
    ).radiance[:, 1]
    assert 0.45 < under / free < 0.7


def test_indoors_there_is_no_haze_and_the_light_comes_from_above(
    level: Make, upright: Make, scenery: Scene
) -> None:
    room = scenery(level("floor"), upright("concrete", 20.0, (-5, 5), (0, 3)))
    floor, wall = look_at(room, INDOOR, (0, 0, 1), [(1, 0, 0), (20, 0.3, 1)]).radiance[:, 1]
    assert floor == pytest.approx(0.40 * 400 / np.pi, rel=1e-4)
    assert wall == pytest.approx(0.39 * 400 / np.pi * (0.5 + 0.5 * 0.15), rel=1e-4)


@pytest.mark.parametrize("panes", [1, 2, 3])
def test_each_pane_passes_its_share_and_mirrors_a_little(
    upright: Make, scenery: Scene, panes: int
) -> None:
    glass = [upright("glass", 2.0 + 0.1 * n, (-3, 3), (-3, 3)) for n in range(panes)]
    wall = upright("concrete", 6.0, (-5, 5), (-5, 5))
    bare = look_at(scenery(wall), INDOOR, (0, 0, 0), [(1, 0.001, 0.002)])
    seen = look_at(scenery(wall, *glass), INDOOR, (0, 0, 0), [(1, 0.001, 0.002)])
    passed, mirrored = 0.86 * 0.92, 0.08 * 0.15 * 400 / np.pi
    expected = bare.radiance[0, 1] * passed**panes
    expected += mirrored * sum(passed**n for n in range(panes))
    assert seen.radiance[0, 1] == pytest.approx(expected, rel=1e-3)
    assert seen.distance[0] == pytest.approx(6.0, rel=1e-4)


def test_glass_mirrors_the_sky_at_grazing_angles(upright: Make, scenery: Scene) -> None:
    scene = scenery(
        upright("glass", 1.0, (-50, 50), (0, 3)), upright("bush", 40, (-300, 300), (-9, 9))
    )
    dull = Light("overcast", UP, 0.0, 10_000.0)
    squarely, grazing = look_at(scene, dull, (0, 0, 1), [(1, 0, 1.05), (1, 20, 1.5)]).radiance[:, 1]
    assert grazing > 2 * squarely


def test_what_is_nearer_than_the_near_limit_is_passed(upright: Make, scenery: Scene) -> None:
    world = scenery(upright("leaf", 0.04, (-1, 1), (-1, 1)), upright("wood", 3, (-9, 9), (-9, 9)))
    assert look_at(world, INDOOR, (0, 0, 0), [(1, 0.01, 0)]).distance[0] > 2.9


def test_where_nothing_is_there_is_sky(level: Make, scenery: Scene) -> None:
    seen = look_at(scenery(level("soil")), INDOOR, (0, 0, 1), [(0, 0, 2)])
    assert np.isinf(seen.distance[0])
    assert seen.radiance[0, 1] == pytest.approx(400 / np.pi, rel=1e-4)
