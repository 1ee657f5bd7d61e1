"""Equation (6): cells move as the robot does, the other way round."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.observation.intensity_map.motion import PlanarMotion, carry_map, shift_map
from tests.graspe_data.observation.intensity_map.slow_reference import slow_carry

CELL = 0.05
MAP = np.random.default_rng(4).random((21, 21)).astype(np.float32)

metres = st.floats(-0.6, 0.6)
angles = st.floats(-4, 4)


@settings(deadline=None, max_examples=40)
@given(forward=metres, left=metres, turn=angles, size=st.integers(5, 30))
def test_agrees_exactly_with_a_loop_over_the_cells(
    forward: float, left: float, turn: float, size: int
) -> None:
    found = carry_map(MAP, PlanarMotion(forward, left, turn), CELL, size)
    assert np.array_equal(found, slow_carry(MAP, (forward, left, turn), CELL, size))


def test_a_cell_forward_brings_every_row_a_cell_nearer() -> None:
    found = carry_map(MAP, PlanarMotion(CELL, 0, 0), CELL)
    assert np.array_equal(found[1:], MAP[:-1])
    assert not found[0].any()


def test_a_cell_to_the_left_brings_every_column_a_cell_to_the_right() -> None:
    found = carry_map(MAP, PlanarMotion(0, CELL, 0), CELL)
    assert np.array_equal(found[:, 1:], MAP[:, :-1])


def test_a_quarter_turn_to_the_left_turns_the_map_to_the_right() -> None:
    found = carry_map(MAP, PlanarMotion(0, 0, math.pi / 2), CELL)
    assert np.array_equal(found, np.rot90(MAP, -1))


@given(forward=st.integers(-25, 25), left=st.integers(-25, 25))
def test_whole_cells_are_shifted_as_they_are_carried(forward: int, left: int) -> None:
    carried = carry_map(MAP, PlanarMotion(float(forward), float(left), 0), 1.0)
    assert np.array_equal(shift_map(MAP, forward, left), carried)


@given(forward=metres, left=metres, turn=angles)
def test_there_and_back_is_where_it_was_to_a_cell(forward: float, left: float, turn: float) -> None:
    spot = np.zeros((61, 61), np.float32)
    spot[26:29, 33:36] = 1
    motion = PlanarMotion(forward, left, turn)
    back = carry_map(carry_map(spot, motion, CELL), motion.inverse, CELL)
    assert np.abs(np.argwhere(back).mean(axis=0) - (27, 34)).max() < 1.0
    assert back[27, 34] == 1


@given(x=metres, y=metres, yaw=angles, forward=metres, left=metres, turn=angles)
def test_between_two_poses_is_the_motion_that_leads_there(
    x: float, y: float, yaw: float, forward: float, left: float, turn: float
) -> None:
    there = (
        x + math.cos(yaw) * forward - math.sin(yaw) * left,
        y + math.sin(yaw) * forward + math.cos(yaw) * left,
        yaw + turn,
    )
    found = PlanarMotion.between((x, y, yaw), there)
    assert (found.forward, found.left, found.turn) == pytest.approx((forward, left, turn))
    back = PlanarMotion.between(there, (x, y, yaw))
    inverse = found.inverse
    assert (inverse.forward, inverse.left) == pytest.approx((back.forward, back.left), abs=1e-9)
