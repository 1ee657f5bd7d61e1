"""From settings and a seed to a world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from graspe_data.errors import ManifestError
from graspe_data.simulation.world.ground import ground_mesh, make_ground
from graspe_data.simulation.world.kinds.ditch import dig
from graspe_data.simulation.world.kinds.plan_feature import plan_feature
from graspe_data.simulation.world.looks import draw_looks
from graspe_data.simulation.world.materials import MATERIALS, Material
from graspe_data.simulation.world.mesh import join_meshes
from graspe_data.simulation.world.obstacles import Obstacle, Obstacles
from graspe_data.simulation.world.placement import place_features
from graspe_data.simulation.world.plan import NOWHERE, Plan, Spots
from graspe_data.simulation.world.settings import WorldSettings
from graspe_data.simulation.world.streams import stream
from graspe_data.simulation.world.world import Ground, World

MOST_TRIANGLES = 6_000_000


def build_world(settings: WorldSettings, name: str, seed: int) -> World:
    """Place everything, then make its surfaces. The same arguments give the same world.

    Args:
        settings: The world's.
        name: Of the scenario; worlds of other names share nothing that is drawn.
        seed: Of everything that is drawn.

    Raises:
        ManifestError: Something placed hinders the start, what is scattered does not fit, or the
            world would have more than 6 million triangles. The text names the feature.
    """
    ground = make_ground(settings.ground, settings.arena, stream(name, seed, "ground"))
    spots = place_features(settings, name, seed)
    ground = dig(settings.features, spots, ground, name, seed)
    plans = _plans(settings, spots, ground, name, seed)
    _check_triangles(settings, plans, 2 * ground.heights.size)
    meshes = [ground_mesh(ground, settings.ground), *(mesh for p in plans for mesh in p.make())]
    obstacles = [_changed(obstacle, settings) for plan in plans for obstacle in plan.obstacles]
    return World(
        join_meshes(meshes),
        _materials(settings, stream(name, seed, "looks")),
        Obstacles.of(obstacles),
        ground,
        settings.arena,
        settings.start,
    )


def _plans(
    settings: WorldSettings, spots: Mapping[int, Spots], ground: Ground, name: str, seed: int
) -> list[Plan]:
    return [
        plan_feature(
            feature,
            spots.get(index, NOWHERE),
            ground,
            settings.arena,
            stream(name, seed, "shapes", index),
        )
        for index, feature in enumerate(settings.features)
    ]


def _check_triangles(settings: WorldSettings, plans: list[Plan], ground: int) -> None:
    counts = [plan.triangles for plan in plans]
    if ground + sum(counts) <= MOST_TRIANGLES:
        return
    largest = int(np.argmax([ground, *counts])) - 1
    name = "ground" if largest < 0 else f"features.{largest}.{settings.features[largest].kind}"
    raise ManifestError(
        f"{name}: this world would have {ground + sum(counts)} triangles, {max([ground, *counts])} "
        f"of them here, expected at most {MOST_TRIANGLES}: lower the density, the number or the "
        "size of things, or the arena."
    )


def _materials(settings: WorldSettings, generator: np.random.Generator) -> tuple[Material, ...]:
    drawn = draw_looks(settings.looks, settings.ground.cover, generator)
    changes = {
        name: change.model_dump(exclude_none=True, exclude={"strength"})
        for name, change in settings.materials.items()
    }
    return tuple(replace(own, **changes.get(name, {})) for name, own in drawn.items())


def _changed(obstacle: Obstacle, settings: WorldSettings) -> Obstacle:
    change = settings.materials.get(obstacle.material)
    own = obstacle.effect == MATERIALS[obstacle.material].effect
    if change is None or not own:
        return obstacle
    strength = obstacle.strength if change.strength is None else change.strength
    return replace(obstacle, effect=change.effect or obstacle.effect, strength=strength)
