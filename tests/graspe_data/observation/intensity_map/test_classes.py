"""Equations (3) to (5), against a loop over the cells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

from graspe_data.observation.intensity_map.classes import ClassSettings, classify_cells
from tests.graspe_data.observation.intensity_map.slow_reference import slow_classes


def layers_of(seed: int, layers: int = 3, cells: int = 12) -> NDArray[np.float32]:
    random = np.random.default_rng(seed)
    values = random.uniform(0, 0.7, (layers, cells, cells)) * (random.random((cells, cells)) < 0.5)
    return values.astype(np.float32)


@settings(deadline=None, max_examples=30)
@given(
    seed=st.integers(0, 1000),
    layers=st.integers(1, 8),
    threshold=st.floats(0, 0.99),
    reading=st.sampled_from(["sum", "each"]),
)
def test_agrees_exactly_with_a_loop_over_the_cells(
    seed: int, layers: int, threshold: float, reading: Any
) -> None:
    values = layers_of(seed, layers)
    found = classify_cells(values, ClassSettings(threshold=threshold, reading=reading))
    solid, pliable = slow_classes(values, threshold, reading)
    assert np.array_equal(found.true_positive, solid)
    assert np.array_equal(found.false_positive, pliable)


@given(seed=st.integers(0, 1000), reading=st.sampled_from(["sum", "each"]))
def test_classes_are_disjoint_and_together_all_cells_with_returns(seed: int, reading: Any) -> None:
    values = layers_of(seed)
    found = classify_cells(values, ClassSettings(reading=reading))
    solid, pliable = found.true_positive > 0, found.false_positive > 0
    assert not (solid & pliable).any()
    assert np.array_equal(solid | pliable, values.any(axis=0))
    assert np.array_equal(found.free, ~values.any(axis=0))


@given(seed=st.integers(0, 1000))
def test_what_the_sum_calls_pliable_each_layer_does_too(seed: int) -> None:
    values = layers_of(seed)
    by_sum = classify_cells(values, ClassSettings()).false_positive > 0
    by_each = classify_cells(values, ClassSettings(reading="each")).false_positive > 0
    assert (by_each | ~by_sum).all()


@pytest.mark.parametrize(("reading", "solid"), [("sum", True), ("each", False)])
def test_the_readings_differ_where_several_layers_are_faint(reading: Any, solid: bool) -> None:
    values = np.full((3, 1, 1), 0.3, np.float32)
    found = classify_cells(values, ClassSettings(threshold=0.6, reading=reading))
    assert bool(found.true_positive[0, 0]) == solid


def test_gamma_itself_is_pliable() -> None:
    values = np.full((1, 1, 1), 0.6, np.float32)
    assert classify_cells(values, ClassSettings(threshold=0.6)).false_positive[0, 0] > 0


@given(seed=st.integers(0, 1000), cells=st.integers(1, 3))
def test_a_rim_is_what_is_less_faint_and_near_something_solid(seed: int, cells: int) -> None:
    values = layers_of(seed)
    printed = classify_cells(values, ClassSettings(threshold=0.5, reading="each"))
    settings = ClassSettings(threshold=0.5, reading="each", rim=0.3, rim_cells=cells)
    found = classify_cells(values, settings)
    rows, columns = np.nonzero(printed.true_positive)
    for row, column in np.ndindex(found.true_positive.shape):
        near = (np.maximum(abs(rows - row), abs(columns - column)) <= cells).any()
        strong = values[:, row, column].max() > np.float32(0.3)
        solid = printed.true_positive[row, column] > 0 or (near and strong)
        assert bool(found.true_positive[row, column] > 0) == bool(solid)
    both = found.true_positive + found.false_positive
    assert np.array_equal(both, printed.true_positive + printed.false_positive)


def test_a_rim_above_gamma_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"rim 0\.7 is above threshold 0\.6"):
        ClassSettings(rim=0.7)
