from typing import Any

import pytest

from graspe_data.errors import ManifestError
from graspe_data.manifest import validate
from graspe_data.simulation.world.settings import WorldSettings


@pytest.mark.parametrize(
    ("feature", "message"),
    [
        ({"kind": "tre", "at": [[3, 3]]}, r"features\.0: Input tag 'tre'"),
        ({"kind": "tree"}, r"features\.0\.tree: expected either per_100_m2 or at, found neither"),
        ({"kind": "tree", "per_100_m2": [1, 2], "at": [[3, 3]]}, "found both"),
        ({"kind": "tree", "at": [[30, 3]]}, r"features\.0\.tree\.at\.0: \(30, 3\) lies outside"),
        ({"kind": "tree", "per_100_m2": [3, 2]}, r"per_100_m2: the lower end 3 is above"),
        ({"kind": "tree", "per_100_m2": [1, 1e9]}, r"per_100_m2: found 1 to 1e\+09, expected"),
        ({"kind": "tree", "at": [[3, 3]], "radus": [1, 2]}, "radus: unknown key.*'radius'"),
        ({"kind": "rock", "per_100_m2": [1, 1], "radius": [-1, 0.1]}, "radius: found -1 to 0.1"),
        ({"kind": "rock", "per_100_m2": [1, 1], "within": [3, 3, 1, 5]}, "within: .*with an area"),
        ({"kind": "rock", "per_100_m2": [1, 1], "within": [3, 3, 90, 5]}, "within: .*outside"),
        ({"kind": "wall", "lines": [[[1, 1], [1, 1]]]}, r"wall: lines\.0: .*shorter than 0\.1 m"),
        ({"kind": "wall", "lines": [[[1, 1], [1, 99]]]}, r"wall\.lines\.0: .*outside"),
        (
            {"kind": "doorway", "lines": [[[1, 1], [1, 2]]]},
            r"doorway: lines\.0: a door of up to 1\.2 m does not fit into a wall of 1 m",
        ),
        ({"kind": "doorway", "per_100_m2": [1, 1], "length": [1, 5]}, "length: a door of up to"),
        ({"kind": "tall_grass", "per_100_m2": [1, 1], "at": [[3, 3]]}, "found both"),
    ],
)
def test_an_impossible_feature_is_refused_by_its_key(feature: dict[str, Any], message: str) -> None:
    with pytest.raises(ManifestError, match=message):
        validate({"features": [feature]}, WorldSettings, "here")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"start": [25, 0, 0]}, r"start: \(25, 0\) lies outside of the arena"),
        ({"length": 1e6}, "length: .*less than or equal to 200"),
        ({"materials": {"gras": {}}}, "materials.gras"),
        ({"materials": {"grass": {"effect": "entangles"}}}, "needs a strength"),
        ({"materials": {"bush": {"effect": "slows", "strength": 2}}}, "at most 1; found 2"),
        ({"materials": {"grass": {"reflectivity": 1.5}}}, "materials.grass.reflectivity"),
        ({"features": [{"kind": "treeline"}] * 65}, "features: .*at most 64"),
    ],
)
def test_an_impossible_world_is_refused_by_its_key(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ManifestError, match=message):
        validate(settings, WorldSettings, "here")


def test_the_arena_lies_around_zero() -> None:
    assert WorldSettings(length=30, width=20).arena == (-15.0, -10.0, 15.0, 10.0)
