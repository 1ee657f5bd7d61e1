"""When a robot that keeps its velocity fails: held against small steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.robot import Robot
from graspe_data.simulation.motion.arc_contacts import failure_times
from graspe_data.simulation.motion.footprint import clearance
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from graspe_data.simulation.motion.walker import advance
from graspe_data.simulation.world.obstacles import Obstacle, Obstacles
from graspe_data.simulation.world.world import World

WorldOf = Callable[..., World]

STEP = 0.005


def disc(x: float, y: float, radius: float, effect: str, strength: float = 0.0) -> Obstacle:
    material = {"stops": "bark", "entangles": "bush", "stumbles": "rock", "slows": "grass"}[effect]
    return Obstacle((x, y), (x, y), radius, effect, material, strength)  # type: ignore[arg-type]


places = st.tuples(st.floats(-2.5, 2.5), st.floats(-2.5, 2.5)).filter(
    lambda place: np.hypot(*place) > 1.2
)
things = st.lists(
    st.builds(
        lambda place, radius, effect, strength: disc(place[0], place[1], radius, effect, strength),
        places,
        st.floats(0.05, 0.5),
        st.sampled_from(["stops", "entangles", "stumbles", "slows"]),
        st.floats(0.1, 0.25),
    ),
    min_size=1,
    max_size=4,
)


def stepped(obstacles: Obstacles, robot: Robot, v: float, omega: float) -> float:
    """When the arc fails, by small steps that vegetation slows."""
    solid = np.array([name == "bark" for name in obstacles.material])
    rock = np.array([name == "rock" for name in obstacles.material])
    bush = np.array([name == "bush" for name in obstacles.material])
    pose = np.zeros(3)
    before = clearance(robot.footprint, pose[None], obstacles)[0]
    began = np.max(np.where(bush, -before, 0.0) / obstacles.strength, initial=0.0)
    for step in range(round(3.0 / STEP)):
        gaps = clearance(robot.footprint, pose[None], obstacles)[0]
        loads = np.maximum(np.where(bush, -gaps, 0.0), 0.0) / obstacles.strength
        deep = (loads > np.log(5)) & (gaps < before - 1e-6)
        if (solid & (gaps < 0)).any() or (rock & (gaps < 0) & (before >= 0)).any() or deep.any():
            return step * STEP
        slower = np.exp(-max(loads.max() - max(began, 0.0), 0.0))
        pose = advance(pose, v * slower, omega * slower, STEP)
    return np.inf


@settings(max_examples=30, deadline=None)
@given(things=things, v=st.floats(-0.6, 0.6), omega=st.floats(-0.6, 0.6))
def test_it_agrees_with_a_simulation_in_small_steps(
    things: list[Obstacle], v: float, omega: float, world_of: WorldOf, spot: Robot
) -> None:
    world = world_of(*things)
    exact = stepped(world.obstacles, spot, v, omega)
    ends = np.arange(1, 11) * 0.3
    clear = np.abs(exact - ends) > 0.06
    asked = world.obstacles, spot.footprint, np.zeros((1, 3)), np.array([[v, omega]])
    (fails,) = failure_times(*asked, 3.0, MechanicsSettings())
    # A corner that only grazes something between two samples may be overlooked.
    if not (np.isfinite(exact) and np.isinf(fails)):
        found = fails > ends + 1e-9
        np.testing.assert_array_equal(found[clear], (exact > ends)[clear])
