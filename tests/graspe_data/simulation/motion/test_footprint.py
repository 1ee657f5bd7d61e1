"""Signed distances between the robot's rectangle and capsules."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.arrays import Floats
from graspe_data.robot import Footprint
from graspe_data.simulation.motion.footprint import capsule_clearance, clearance
from graspe_data.simulation.world.obstacles import Obstacle, Obstacles

SPOT = Footprint(length=1.1, width=0.5)
HERE = np.zeros((1, 3))

metres = st.floats(-3.0, 3.0)
points = st.tuples(metres, metres)


def disc(x: float, y: float, radius: float) -> Obstacles:
    return Obstacles.of([Obstacle((x, y), (x, y), radius, "stops", "bark")])


@pytest.mark.parametrize(
    ("x", "y", "radius", "expected"),
    [
        (2.0, 0.0, 0.3, 2.0 - 0.55 - 0.3),
        (0.0, -1.0, 0.1, 1.0 - 0.25 - 0.1),
        (0.55 + 0.3, 0.25 + 0.4, 0.2, 0.5 - 0.2),
        (0.6, 0.0, 0.15, -0.1),
        (0.0, 0.0, 0.1, -0.35),
        (0.5, 0.0, 0.1, -0.15),
    ],
    ids=["ahead", "beside", "off a corner", "touching", "under the middle", "under the front"],
)
def test_a_disc_apart_is_as_far_as_its_edge_and_overlapping_as_deep_as_the_shortest_way_out(
    x: float, y: float, radius: float, expected: float
) -> None:
    assert clearance(SPOT, HERE, disc(x, y, radius))[0, 0] == pytest.approx(expected)


def test_a_line_across_the_front_is_as_deep_as_the_robot_has_driven_over_it() -> None:
    line = Obstacles.of([Obstacle((0.4, -5.0), (0.4, 5.0), 0.02, "entangles", "vine", 0.1)])
    assert clearance(SPOT, HERE, line)[0, 0] == pytest.approx(-(0.15 + 0.02))


def in_frame(pose: tuple[float, float, float], point: Floats) -> Floats:
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    turned: Floats = (point - np.array(pose[:2])) @ np.array([[cosine, -sine], [sine, cosine]])
    return turned


def sampled_distance(
    pose: tuple[float, float, float], start: tuple[float, float], end: tuple[float, float]
) -> float:
    """From points of the segment to the rectangle."""
    shares = np.linspace(0.0, 1.0, 2001)[:, None]
    along = in_frame(pose, np.array(start) * (1 - shares) + np.array(end) * shares)
    beyond = np.maximum(np.abs(along) - np.array([0.55, 0.25]), 0.0)
    return float(np.linalg.norm(beyond, axis=1).min())


@settings(max_examples=300, deadline=None)
@given(st.tuples(metres, metres, st.floats(-7.0, 7.0)), points, points, st.floats(0.0, 1.0))
def test_apart_it_is_the_distance_of_densely_sampled_points(
    pose: tuple[float, float, float],
    start: tuple[float, float],
    end: tuple[float, float],
    radius: float,
) -> None:
    found = capsule_clearance(SPOT, np.array(pose), np.array(start), np.array(end), radius)
    expected = sampled_distance(pose, start, end)
    if expected > 0.01:
        assert float(found) == pytest.approx(expected - radius, abs=0.003)
    else:
        assert float(found) <= expected - radius + 1e-9


@settings(max_examples=200, deadline=None)
@given(st.tuples(metres, metres, st.floats(-7.0, 7.0)), points, points, st.floats(0.01, 1.0))
def test_overlapping_it_is_the_least_shift_that_parts_them(
    pose: tuple[float, float, float],
    start: tuple[float, float],
    end: tuple[float, float],
    radius: float,
) -> None:
    ends = np.array(start), np.array(end)
    depth = -float(capsule_clearance(SPOT, np.array(pose), *ends, radius))
    if depth <= 0.01:
        return
    angles = np.linspace(0.0, 2 * np.pi, 721)
    shifts = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
    nearly = np.array(pose) + (depth - 0.005) * shifts
    wholly = np.array(pose) + (depth + 0.005) * shifts
    assert (capsule_clearance(SPOT, nearly, *ends, radius) < 0).all()
    assert (capsule_clearance(SPOT, wholly, *ends, radius) > 0).any()


@settings(max_examples=100, deadline=None)
@given(points, points, st.tuples(metres, metres, st.floats(-3.0, 3.0)))
def test_it_does_not_depend_on_where_the_world_begins_or_on_the_order_of_the_ends(
    start: tuple[float, float], end: tuple[float, float], moved: tuple[float, float, float]
) -> None:
    cosine, sine = np.cos(moved[2]), np.sin(moved[2])
    turn = np.array([[cosine, -sine], [sine, cosine]])
    a, b = (turn @ np.array(point) + np.array(moved[:2]) for point in (start, end))
    radius = 0.2
    there = capsule_clearance(SPOT, np.array(moved), b, a, radius)
    here = capsule_clearance(SPOT, np.zeros(3), np.array(start), np.array(end), radius)
    assert float(there) == pytest.approx(float(here), abs=1e-6)
