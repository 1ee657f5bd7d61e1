"""The pane about a glint: where its line is drawn, and where it ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.observation.intensity_map.classes import CellClasses
from graspe_data.observation.intensity_map.glass import GlassSettings
from graspe_data.observation.intensity_map.panes import extend_glass

Map = NDArray[np.float32]
SIDE = 41
AHEAD = (30.0, 20.0)
"""An eye from which the glint of ``glinting`` lies straight ahead."""
SETTINGS = GlassSettings(extend=6, smallest=3, margin=1)


def glinting() -> Map:
    glass = np.zeros((SIDE, SIDE), np.float32)
    glass[10, 19:22] = (0.2, 0.4, 0.2)
    return glass


def nothing() -> Map:
    return np.zeros((SIDE, SIDE), np.float32)


def extended(glass: Map, pliable: Map, solid: Map, eye: tuple[float, float] = AHEAD) -> Map:
    layers = np.stack((pliable + solid, np.maximum(glass, pliable + solid)))
    return extend_glass(glass, layers, CellClasses(solid, pliable), eye, SETTINGS)


def test_it_lies_square_to_the_line_of_sight_and_is_as_strong_as_the_glint() -> None:
    found = extended(glinting(), nothing(), nothing())
    assert np.argwhere(found == np.float32(0.4)).tolist() == [[10, c] for c in range(14, 27)]
    aside = extended(glinting().T.copy(), nothing(), nothing(), (20.0, 30.0))
    assert np.array_equal(aside, found.T)


def test_seen_from_the_corner_it_is_a_diagonal() -> None:
    found = extended(glinting(), nothing(), nothing(), (30.0, 40.0))
    rows, columns = np.nonzero(found == np.float32(0.4))
    assert set((rows + columns).tolist()) <= {29, 30, 31}
    assert np.hypot(rows - 10, columns - 20).max() == pytest.approx(6, abs=0.8)


def test_it_ends_at_what_hangs_in_a_doorway_and_goes_on_behind_a_frame() -> None:
    post, beads = nothing(), nothing()
    post[10, 17] = 0.9
    beads[9:12, 23:] = 0.4
    found = extended(glinting(), beads, post)
    assert np.flatnonzero(found[10] == np.float32(0.4)).tolist() == list(range(14, 23))


def test_the_rim_of_a_frame_is_no_doorway() -> None:
    post, rim = nothing(), nothing()
    post[10, 17], rim[10, 16] = 0.9, 0.2
    found = extended(glinting(), rim, post)
    assert np.flatnonzero(found[10] == np.float32(0.4)).tolist() == list(range(14, 27))


def test_small_glints_and_no_extension_leave_the_map_alone() -> None:
    small = nothing()
    small[10, 19:21] = 0.4
    assert np.array_equal(extended(small, nothing(), nothing()), small)
    classes = CellClasses(nothing(), nothing())
    layers = np.stack((nothing(), glinting()))
    assert extend_glass(glinting(), layers, classes, AHEAD, GlassSettings()) is not None
    assert np.array_equal(
        extend_glass(glinting(), layers, classes, AHEAD, GlassSettings()), glinting()
    )


@given(st.integers(0, 10**6))
def test_no_cell_gets_lower_and_none_higher_than_the_strongest_glint(seed: int) -> None:
    draw = np.random.default_rng(seed)
    glass = (draw.random((SIDE, SIDE)) * (draw.random((SIDE, SIDE)) < 0.3)).astype(np.float32)
    pliable = (draw.random((SIDE, SIDE)) < 0.1).astype(np.float32)
    eye = tuple(draw.uniform(0, SIDE, 2).tolist())
    found = extended(glass, pliable, nothing(), eye)
    assert (found >= glass).all()
    assert found.max() == glass.max()
