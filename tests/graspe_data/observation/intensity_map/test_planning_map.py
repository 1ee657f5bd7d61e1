"""Equation (11), and the whole way from a cloud."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.observation.intensity_map import (
    ClassSettings,
    GlassMemory,
    GlassSettings,
    InflationSettings,
    Moment,
    PlanningMap,
    PlanningMapSettings,
    planning_map,
)
from tests.graspe_data.observation.intensity_map.slow_reference import (
    slow_classes,
    slow_inflation,
    slow_kernel,
)
from tests.graspe_data.observation.intensity_map.test_classes import layers_of

START = Moment(0, (0.0, 0.0, 0.0), (3.0, 1.0))


def mapped(
    layers: NDArray[np.float32],
    settings: PlanningMapSettings,
    moment: Moment = START,
    memory: GlassMemory | None = None,
) -> PlanningMap:
    return planning_map(layers, moment, memory, 0.05, settings)


def thin(seed: int) -> NDArray[np.float32]:
    """A map of which most is free."""
    kept = np.random.default_rng(seed + 1).random((40, 40)) < 0.1
    return layers_of(seed, cells=40) * kept.astype(np.float32)


@pytest.mark.parametrize("seed", range(5))
def test_agrees_exactly_with_the_equations_one_after_the_other(seed: int) -> None:
    layers, one = thin(seed), np.float32(1)
    found = mapped(layers, PlanningMapSettings())
    solid, pliable = slow_classes(layers, 0.6, "sum")
    glass = np.maximum(layers[1] - layers[0], np.float32(0))
    kernel = slow_kernel((3.0, 1.0), 11, 2.0, 2.0) == 1
    inflated = slow_inflation(np.minimum(solid + glass, one), kernel)
    assert np.array_equal(found.glass, glass)
    assert np.array_equal(found.inflated, inflated)
    assert np.array_equal(found.cost, np.minimum(inflated + pliable, one))


def test_what_is_pliable_is_not_inflated_and_what_is_solid_is() -> None:
    layers = np.zeros((3, 40, 40), np.float32)
    layers[:, 10, 10], layers[:, 30, 30] = 0.1, 0.9
    cost = mapped(layers, PlanningMapSettings()).cost
    assert np.count_nonzero(cost[:20, :20]) == 1
    assert np.count_nonzero(cost[20:, 20:]) > 20


def test_glass_seen_before_is_in_the_way_when_it_is_seen_no_more() -> None:
    layers = np.zeros((3, 40, 40), np.float32)
    layers[1, 10, 20] = 0.3
    settings = PlanningMapSettings(glass=GlassSettings(memory_s=10))
    first = mapped(layers, settings)
    later = Moment(10**9, (0.25, 0.0, 0.0), (3.0, 0.0))
    second = mapped(np.zeros_like(layers), settings, later, first.memory)
    assert np.argwhere(second.glass).tolist() == [[15, 20]]
    assert second.cost[15, 20] == pytest.approx(0.3 * np.exp(-0.1))


def test_without_glass_nothing_is_remembered() -> None:
    found = mapped(thin(0), PlanningMapSettings(glass=None))
    assert found.memory is None
    assert not found.glass.any()


def test_uniform_inflation_and_the_other_reading_are_a_setting_away() -> None:
    settings = PlanningMapSettings(
        classes=ClassSettings(reading="each"), inflation=InflationSettings(form="uniform")
    )
    layers = np.zeros((3, 40, 40), np.float32)
    layers[0, 20, 20] = 0.9
    assert np.count_nonzero(mapped(layers, settings).cost) == 121
