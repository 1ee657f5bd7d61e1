import numpy as np
import pytest

from graspe_data.errors import ManifestError
from graspe_data.simulation.world.capsules import capsule_gaps
from graspe_data.simulation.world.kinds.blobs import Boulder, Rock
from graspe_data.simulation.world.kinds.bush import Bush
from graspe_data.simulation.world.kinds.fence import Fence
from graspe_data.simulation.world.kinds.tall_grass import TallGrass
from graspe_data.simulation.world.kinds.tree import Tree
from graspe_data.simulation.world.kinds.wall import Wall
from graspe_data.simulation.world.placement import place_features
from graspe_data.simulation.world.plan import Spots
from graspe_data.simulation.world.settings import MaterialChange, WorldSettings

TREES = Tree(per_100_m2=(2, 2))
BUSHES = Bush(per_100_m2=(3, 3))
FENCES = Fence(per_100_m2=(0.3, 0.3))


def _place(point: tuple[float, float]) -> Spots:
    return Spots(np.array([point]), np.array([point]), np.zeros(1))


@pytest.mark.parametrize("seed", range(5))
def test_between_solid_things_there_is_always_a_free_way(seed: int) -> None:
    settings = WorldSettings(features=(TREES, FENCES, BUSHES), clearance=1.0)
    spots = list(place_features(settings, "tried", seed).values())
    for first in spots:
        for second in spots:
            gaps = capsule_gaps(first, second)
            if first is second:
                np.fill_diagonal(gaps, np.inf)
            assert gaps.min() >= 1.0


@pytest.mark.parametrize("seed", range(5))
def test_the_start_is_free_of_what_hinders(seed: int) -> None:
    settings = WorldSettings(
        length=12,
        width=12,
        features=(TREES, BUSHES, Rock(per_100_m2=(30, 30))),
        start_clearance=2.5,
    )
    for spots in place_features(settings, "tried", seed).values():
        assert capsule_gaps(spots, _place((0, 0))).min() >= 2.5


def test_numbers_follow_the_density_and_things_stay_in_their_region() -> None:
    rocks = Rock(per_100_m2=(10, 10), within=(2, 2, 12, 14))
    counts = []
    for seed in range(20):
        spots = place_features(WorldSettings(features=(rocks,)), "tried", seed)[0]
        assert np.all((spots.start >= [2, 2]) & (spots.start <= [12, 14]))
        counts.append(len(spots))
    assert set(counts) <= {12}


def test_intertwined_things_may_stand_among_others() -> None:
    close = Bush(per_100_m2=(20, 20), intertwined=True)
    settings = WorldSettings(length=20, width=20, features=(Tree(per_100_m2=(4, 4)), close))
    trees, bushes = place_features(settings, "tried", 0).values()
    assert capsule_gaps(trees, bushes).min() < 0.2


def test_a_changed_feature_leaves_the_others_in_place() -> None:
    rocks, fences = Rock(per_100_m2=(2, 2)), FENCES
    one = place_features(WorldSettings(features=(rocks, fences, TREES)), "tried", 7)
    other = place_features(
        WorldSettings(features=(Rock(per_100_m2=(9, 9)), fences, TREES)), "tried", 7
    )
    assert len(one[0]) != len(other[0])
    for index in (1, 2):
        np.testing.assert_array_equal(one[index].start, other[index].start)


def test_scattered_things_give_way_to_placed_ones_named_later() -> None:
    wall = Wall(lines=(((-20, 5), (20, 5)),))
    trees, walls = place_features(WorldSettings(features=(TREES, wall)), "tried", 1).values()
    bare = WorldSettings(features=(wall, TREES))
    assert capsule_gaps(walls, trees).min() >= bare.clearance or len(trees) == 1


def test_filling_grass_covers_its_region_with_stripes_side_by_side() -> None:
    settings = WorldSettings(features=(TallGrass(within=(-3, 1, 9, 4.5)),))
    stripes = place_features(settings, "tried", 0)[0]
    points = np.random.default_rng(0).uniform((-2.5, 1), (8.5, 4.5), (500, 2))
    inside = capsule_gaps(Spots(points, points, np.zeros(500)), stripes) <= 1e-9
    assert inside.any(axis=1).all()
    assert inside.sum(axis=1).max() == 1


def test_a_robot_born_inside_a_tree_is_an_error_that_says_where() -> None:
    tree = Tree(at=((5, 5), (1.0, 0.05)), radius=(0.2, 0.2))
    settings = WorldSettings(features=(BUSHES, tree), start=(1.0, 0.0, 0.0))
    message = r"features\.1\.tree\.at\.1: the robot would be born inside the tree at \(1, 0\.05\)"
    with pytest.raises(ManifestError, match=message):
        place_features(settings, "tried", 0)


def test_a_wall_too_near_to_the_start_is_an_error_with_the_distance() -> None:
    settings = WorldSettings(features=(Wall(lines=(((-3, 1), (3, 1)),), thickness=0.2),))
    message = r"features\.0\.wall\.lines\.0: .* born 0\.90 m from the wall .* at least 1\.5 m"
    with pytest.raises(ManifestError, match=message):
        place_features(settings, "tried", 0)


def test_grass_at_the_start_is_no_error_unless_it_is_made_to_hinder() -> None:
    grass = TallGrass(at=((0, 0),))
    place_features(WorldSettings(features=(grass,)), "tried", 0)
    tough = {"grass": MaterialChange(effect="entangles", strength=0.3)}
    with pytest.raises(ManifestError, match="born inside the tall grass"):
        place_features(WorldSettings(features=(grass,), materials=tough), "tried", 0)


def test_what_cannot_fit_says_so() -> None:
    crowd = Boulder(per_100_m2=(40, 40), radius=(0.8, 0.8))
    message = r"features\.0\.boulder\.per_100_m2: found no free place for number \d+ of 160"
    with pytest.raises(ManifestError, match=message):
        place_features(WorldSettings(length=20, width=20, features=(crowd,)), "tried", 0)


def test_too_many_things_are_refused_before_they_are_drawn() -> None:
    rocks = Rock(per_100_m2=(60, 60))
    with pytest.raises(ManifestError, match="24000 things"):
        place_features(WorldSettings(length=200, width=200, features=(rocks,)), "tried", 0)
