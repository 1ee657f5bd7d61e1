"""No world that a model is tried in has a layer of a world that it was trained in."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import numpy as np
import pytest

from graspe_data.arrays import Floats
from graspe_data.manifest import find_manifest
from graspe_data.simulation.scenario import Scenario, load_scenario
from graspe_data.simulation.world.feature import Feature
from graspe_data.simulation.world.ground import make_ground
from graspe_data.simulation.world.placement import place_features
from graspe_data.simulation.world.streams import stream

FOLDER = find_manifest("scenarios", "meadow").parent
SCENARIOS = tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))
SEEDS = (*range(16), *range(900, 904))
"""Of training worlds and test scenarios, and of validation worlds: see datasets/field.yaml."""


def scattered_layers(scenario: Scenario, seed: int) -> Iterator[tuple[str, Floats]]:
    """The layers of a world that are drawn: where things stand, each region taken as 1 by 1."""
    world = scenario.world
    for index, spots in place_features(world, scenario.name, seed).items():
        feature = world.features[index]
        if isinstance(feature, Feature) and feature.per_100_m2 is not None and len(spots):
            low, high = np.reshape(feature.within or world.arena, (2, 2))
            yield (
                f"{scenario.name}-{seed} {feature.kind}.{index}",
                (spots.start - low) / (high - low),
            )


def test_no_two_worlds_share_the_layout_of_a_layer() -> None:
    holders: defaultdict[tuple[float, ...], set[str]] = defaultdict(set)
    for name in SCENARIOS:
        scenario, _ = load_scenario(name)
        for seed in SEEDS:
            for layer, places in scattered_layers(scenario, seed):
                for place in np.round(places, 9).tolist():
                    holders[tuple(place)].add(layer)
    assert len(holders) > 10_000
    shared = sorted({" = ".join(sorted(layers)) for layers in holders.values() if len(layers) > 1})
    assert not shared, f"{len(shared)} layers stand in two worlds, such as {shared[:5]}"


@pytest.mark.parametrize("seed", [0, 6])
def test_the_same_ground_of_another_scenario_has_other_hills(seed: int) -> None:
    world = load_scenario("meadow")[0].world
    one, other = (
        make_ground(world.ground, world.arena, stream(name, seed, "ground")).heights
        for name in ("meadow", "woodland")
    )
    assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.5
