import time

import numpy as np
import pytest

from graspe_data.errors import ManifestError
from graspe_data.simulation.world.build_world import build_world
from graspe_data.simulation.world.kinds.bush import Bush
from graspe_data.simulation.world.kinds.hanging_leaves import HangingLeaves
from graspe_data.simulation.world.kinds.tall_grass import TallGrass
from graspe_data.simulation.world.kinds.tree import Tree
from graspe_data.simulation.world.materials import FLAT, MATERIAL_NAMES, MATERIALS
from graspe_data.simulation.world.settings import MaterialChange, WorldSettings

FIELD = WorldSettings(
    features=(
        Tree(per_100_m2=(2.1, 2.1)),
        Bush(per_100_m2=(3.3, 3.3)),
        TallGrass(per_100_m2=(1.0, 1.0)),
    )
)


def test_the_same_seed_gives_the_same_world_to_the_byte() -> None:
    one, same, other = (build_world(FIELD, "tried", seed) for seed in (4, 4, 5))
    assert one.surfaces.vertices.tobytes() == same.surfaces.vertices.tobytes()
    assert one.surfaces.faces.tobytes() == same.surfaces.faces.tobytes()
    assert one.obstacles.strength.tobytes() == same.obstacles.strength.tobytes()
    assert one.ground.heights.tobytes() == same.ground.heights.tobytes()
    assert one.surfaces.vertices.tobytes() != other.surfaces.vertices.tobytes()


def test_a_typical_field_is_built_in_a_second_and_a_half() -> None:
    start = time.perf_counter()
    world = build_world(FIELD, "tried", 1)
    assert time.perf_counter() - start < 1.5
    assert 200_000 < len(world.surfaces.faces) < 2_000_000


def test_arena_and_start_are_handed_on() -> None:
    world = build_world(WorldSettings(length=10, width=8, start=(1, 2, 0.5)), "tried", 0)
    assert world.arena == (-5.0, -4.0, 5.0, 4.0)
    assert world.start == (1.0, 2.0, 0.5)
    listed = [look for name, look in MATERIALS.items() if name not in FLAT]
    assert list(world.materials[: len(listed)]) == listed


def test_a_world_too_large_names_its_largest_feature_before_making_it() -> None:
    jungle = TallGrass(leaf_area_density=(20, 20), blade_width=0.002)
    settings = WorldSettings(length=200, width=200, features=(Tree(per_100_m2=(0, 0)), jungle))
    start = time.perf_counter()
    with pytest.raises(ManifestError, match=r"features\.1\.tall_grass: .* at most 6000000"):
        build_world(settings, "tried", 0)
    assert time.perf_counter() - start < 2


def test_a_material_may_look_and_act_differently_in_one_world() -> None:
    changes = {
        "grass": MaterialChange(reflectivity=0.9, effect="entangles", strength=0.4),
        "hanging_leaf": MaterialChange(effect="slows", strength=0.7),
    }
    features = (TallGrass(at=((5, 5),)), HangingLeaves(at=((0, 0),)), Bush(at=((-5, 5),)))
    world = build_world(WorldSettings(features=features, materials=changes), "tried", 0)
    grass = world.materials[MATERIAL_NAMES.index("grass")]
    assert (grass.reflectivity, grass.colour) == (0.9, MATERIALS["grass"].colour)
    assert world.obstacles.having("entangles").material == ("grass", "bush")
    assert world.obstacles.having("slows").material == ("hanging_leaf",)
    np.testing.assert_allclose(world.obstacles.strength[:2], [0.4, 0.7])
