"""Would an arc of constant velocity get through the world?"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.truth.events import true_events
from graspe_data.simulation.truth.outlook import anchor_success, arc_success, candidate_success
from graspe_data.simulation.world.obstacles import Obstacle
from graspe_data.simulation.world.world import World

WorldOf = Callable[..., World]
DriveOf = Callable[..., Drive]


def disc(x: float, y: float, radius: float, effect: str, strength: float = 0.0) -> Obstacle:
    material = {"stops": "bark", "entangles": "bush", "stumbles": "rock", "slows": "grass"}[effect]
    return Obstacle((x, y), (x, y), radius, effect, material, strength)  # type: ignore[arg-type]


def outlook(world: World, robot: Robot, v: float, omega: float = 0.0) -> list[bool]:
    found = arc_success(world, robot, np.zeros((1, 3)), np.array([[v, omega]]))
    answer: list[bool] = found[0].tolist()
    return answer


def test_an_open_field_lets_every_arc_through(world_of: WorldOf, spot: Robot) -> None:
    assert outlook(world_of(), spot, 0.6, 0.5) == [True] * 10


@pytest.mark.parametrize("seconds", [0.1, 0.29, 0.31, 1.0, 2.95])
def test_an_arc_fails_in_the_step_in_which_it_meets_a_wall(
    seconds: float, world_of: WorldOf, spot: Robot
) -> None:
    front = spot.footprint.length / 2 + 0.5 * seconds
    wall = Obstacle((front + 0.1, -4.0), (front + 0.1, 4.0), 0.1, "stops", "concrete")
    failing = int(seconds / 0.3)
    assert outlook(world_of(wall), spot, 0.5) == [True] * failing + [False] * (10 - failing)


def test_a_bush_fails_an_arc_when_it_has_eaten_the_speed(world_of: WorldOf, spot: Robot) -> None:
    strength, speed, way = 0.15, 0.5, 0.2
    bush = disc(0.55 + way + 1.0, 0.0, 1.0, "entangles", strength)
    # Free until the bush; inside dx/dt = v exp(-x / s), so exp(x / s) = 5 after 4 s / v.
    fails = way / speed + 4 * strength / speed
    expected = [fails > (step + 1) * 0.3 for step in range(10)]
    assert outlook(world_of(bush), spot, speed) == expected


def test_a_brush_with_the_edge_of_a_bush_is_no_failure(world_of: WorldOf, spot: Robot) -> None:
    edge = disc(1.2, 0.25 + 0.45, 0.5, "entangles", 0.2)
    assert outlook(world_of(edge), spot, 0.5) == [True] * 10


def test_the_way_out_of_a_bush_is_no_failure_but_the_way_further_in_is(
    world_of: WorldOf, spot: Robot
) -> None:
    deep = world_of(disc(0.9, 0.0, 0.8, "entangles", 0.15))
    assert outlook(deep, spot, -0.2) == [True] * 10
    assert not any(outlook(deep, spot, 0.05))


def test_a_rock_that_comes_under_the_feet_fails_and_one_already_there_does_not(
    world_of: WorldOf, spot: Robot
) -> None:
    assert outlook(world_of(disc(0.9, 0.0, 0.1, "stumbles", 0.1)), spot, 0.5) == [
        *[True],
        *[False] * 9,
    ]
    assert outlook(world_of(disc(0.4, 0.0, 0.1, "stumbles", 0.1)), spot, 0.5) == [True] * 10


def test_tall_grass_fails_nothing(world_of: WorldOf, spot: Robot) -> None:
    assert outlook(world_of(disc(1.0, 0.0, 2.0, "slows", 0.5)), spot, 0.5) == [True] * 10


def test_standing_beside_a_wall_succeeds_and_a_turn_into_it_fails(
    world_of: WorldOf, spot: Robot
) -> None:
    fence = world_of(Obstacle((-3.0, 0.35), (3.0, 0.35), 0.05, "stops", "wood"))
    assert outlook(fence, spot, 0.0) == [True] * 10
    assert not all(outlook(fence, spot, 0.0, 0.5))


def test_many_arcs_among_many_obstacles_are_quick(world_of: WorldOf, spot: Robot) -> None:
    drawn = np.random.default_rng(3)
    spots = drawn.uniform((-20.0, -15.0), (20.0, 15.0), (300, 2)).tolist()
    effects = ["stops", "entangles", "stumbles"] * 100
    world = world_of(
        *(disc(x, y, 0.3, effect, 0.15) for (x, y), effect in zip(spots, effects, strict=True))
    )
    poses = drawn.uniform((-18.0, -13.0, -3.0), (18.0, 13.0, 3.0), (600, 3))
    velocities = drawn.uniform((0.0, -0.6), (0.6, 0.6), (600, 2))
    began = time.process_time()
    arc_success(world, spot, poses, velocities)
    assert time.process_time() - began < 2.0


def test_while_the_robot_is_held_no_step_of_an_anchor_succeeds(
    world_of: WorldOf, scripted: DriveOf, spot: Robot
) -> None:
    world = world_of(disc(2.0, 0.0, 0.3, "stops"))
    drive = scripted(world, [Leg(6.0, 0.5, 0.0), Leg(3.0, -0.4, 0.0)])
    (stuck,) = (event for event in true_events(drive) if event.kind == "stuck")
    times = np.arange(0.0, 8.9, 0.1)
    success = anchor_success(world, spot, drive, times)
    held = (times * 1e9 >= stuck.start_ns) & (times * 1e9 <= stuck.stop_ns)
    assert not success[held].any()
    assert success[times > 7.0].all()
    assert (np.diff(success.astype(int), axis=1) <= 0).all()


def test_a_candidate_of_the_driven_velocity_ends_as_the_anchor_does(
    world_of: WorldOf, scripted: DriveOf, spot: Robot
) -> None:
    world = world_of(disc(2.0, 0.0, 0.3, "stops"))
    drive = scripted(world, [Leg(6.0, 0.5, 0.0), Leg(3.0, -0.4, 0.0)])
    moments = np.arange(0, len(drive.time_s), 25)
    driven = drive.velocity[moments]
    aside = np.broadcast_to((0.5, 0.6), driven.shape)
    both = candidate_success(world, spot, drive, moments, np.stack([driven, aside], axis=1))
    anchors = anchor_success(world, spot, drive, drive.time_s[moments])
    np.testing.assert_array_equal(both[:, 0], anchors)
    assert (both[:, 1].all(axis=1) & ~anchors.all(axis=1)).any()
