"""Looks that tell nothing of what a thing does, and those that stay as they were."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.stats import ks_2samp

from graspe_data.arrays import Floats
from graspe_data.manifest import load_manifest, shipped_manifests
from graspe_data.simulation.scenario import Scenario
from graspe_data.simulation.world.build_world import build_world
from graspe_data.simulation.world.looks import DULL, FOLIAGE, Table, draw_looks
from graspe_data.simulation.world.materials import FLAT, MATERIAL_NAMES, MATERIALS
from graspe_data.simulation.world.settings import MaterialChange, WorldSettings

WORLDS = 300
UNLIKELY = 1e-4
PAPERS = ("graspe_?_*", "intensity_?_*")


def drawn(seed: int) -> Table:
    return draw_looks("decoupled", "soil", np.random.default_rng(seed))


@pytest.fixture(scope="module")
def looks() -> dict[str, Floats]:
    """Reflectivity, colour and contrast (WORLDS, 5) of each material over worlds."""
    tables = [drawn(seed) for seed in range(WORLDS)]
    return {
        str(name): np.array(
            [(look.reflectivity, *look.colour, look.contrast) for look in (t[name] for t in tables)]
        )
        for name in (*FOLIAGE, *DULL)
    }


@pytest.mark.parametrize("family", [FOLIAGE, DULL], ids=["foliage", "dull"])
def test_decoupled_looks_tell_nothing_of_the_effect(
    looks: dict[str, Floats], family: tuple[str, ...]
) -> None:
    tellable = [name for name in family if name not in FLAT]
    assert len({MATERIALS[name].effect for name in tellable}) >= 3  # type: ignore[index]
    for one, other in combinations(tellable, 2):
        for column in range(5):
            told = ks_2samp(looks[one][:, column], looks[other][:, column])
            assert told.pvalue > UNLIKELY, (one, other, column)


def test_plants_reflect_a_beam_as_trunks_and_walls_do(looks: dict[str, Floats]) -> None:
    bushes, trunks = looks["bush"][:, 0], looks["bark"][:, 0]
    assert ks_2samp(bushes, trunks).pvalue > UNLIKELY
    assert np.mean(looks["grass"][:, 0] > bushes) == pytest.approx(0.5, abs=0.1)


def test_typical_looks_are_those_listed_but_for_what_lies_flat() -> None:
    table = draw_looks("typical", "gravel", np.random.default_rng(0))
    assert {name: look for name, look in table.items() if name not in FLAT} == {
        name: look for name, look in MATERIALS.items() if name not in FLAT
    }


@pytest.mark.parametrize("looks", ["typical", "decoupled"])
def test_a_lidar_cannot_tell_what_lies_flat_from_the_ground(looks: str) -> None:
    table = draw_looks(looks, "gravel", np.random.default_rng(1))  # type: ignore[arg-type]
    assert {table[name].reflectivity for name in FLAT} == {table["gravel"].reflectivity}


def test_what_a_manifest_says_of_a_material_is_not_drawn_over() -> None:
    change = {"bush": MaterialChange(reflectivity=0.42, colour=(0.1, 0.2, 0.3))}
    settings = WorldSettings(looks="decoupled", materials=change)
    worlds = [build_world(settings, "tried", seed).materials for seed in range(3)]
    bush, bark = MATERIAL_NAMES.index("bush"), MATERIAL_NAMES.index("bark")
    assert {table[bush].reflectivity for table in worlds} == {0.42}
    assert {table[bush].colour for table in worlds} == {(0.1, 0.2, 0.3)}
    assert len({table[bark].reflectivity for table in worlds}) == 3


def test_the_papers_scenarios_stay_typical_and_every_training_world_is_drawn() -> None:
    folder = shipped_manifests() / "scenarios"
    papers = {path for pattern in PAPERS for path in folder.glob(f"{pattern}.yaml")}
    for path in folder.glob("*.yaml"):
        found = load_manifest(path, Scenario).world.looks
        typical = path in papers and not path.stem.endswith("_decoupled")
        assert found == ("typical" if typical else "decoupled"), path.stem
