"""Seeds whose worlds have room for the robot at the goal."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from graspe_data.errors import StageError
from graspe_data.simulation.field import scenario_world
from graspe_data.simulation.motion.footprint import clearance
from pipelines.trials.config import Conditions

MOST_BARRED = 100


def fair_seeds(conditions: Conditions, first: int, count: int) -> list[int]:
    """The first seeds, from one on, in whose worlds the robot can stand at the goal any way round.

    They do not depend on the methods.

    Args:
        conditions: World, robot and goal.
        first: The first seed to look at.
        count: How many.

    Raises:
        ManifestError: A world cannot be built.
        StageError: The goal is barred in too many worlds.
    """
    found: list[int] = []
    for seed in _open(conditions, first):
        found.append(seed)
        if len(found) == count:
            break
    else:
        x, y = conditions.scenario.goal or (0.0, 0.0)
        raise StageError(
            f"{conditions.scenario.name}: something stands at the goal ({x:g}, {y:g}) in "
            f"{MOST_BARRED} worlds on end: move the goal."
        )
    return found


def _open(conditions: Conditions, first: int) -> Iterator[int]:
    barred, seed = 0, first
    while barred < MOST_BARRED:
        if _is_open(conditions, seed):
            barred = 0
            yield seed
        else:
            barred += 1
        seed += 1


def _is_open(conditions: Conditions, seed: int) -> bool:
    world, footprint = scenario_world(conditions.scenario, seed), conditions.robot.footprint
    x, y = conditions.scenario.goal or world.start[:2]
    ways = np.linspace(0.0, np.pi, 12, endpoint=False)
    poses = np.column_stack([np.full(12, x), np.full(12, y), ways])
    solid = world.obstacles.having("stops", "entangles")
    return bool((clearance(footprint, poses, solid) > 0).all())
