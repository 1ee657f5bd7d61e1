"""Closed-form ways until contact against marching along the arc."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.observation.trajectory import constant_velocity_arc
from graspe_data.robot import Footprint, Limits
from planners.arc_distance import FreeWay, admissible, free_way
from planners.body_discs import Body, BodySettings, body_discs

SPOT = Footprint(length=1.1, width=0.5)
LIMITS = Limits(
    linear_velocity=(-0.6, 0.6), yaw_rate=(-2, 2), linear_acceleration=0.5, yaw_acceleration=2.0
)
DISC = Body(np.array([[0.0, 0.5]]), 0.5)
STEP_S = 0.002
HORIZON_S = 12.0

Floats = NDArray[np.float64]


def marched(v: float, omega: float, point: Floats, discs: Floats) -> float:
    """Seconds until a disc covers the point while the distance falls, by small steps."""
    arc = constant_velocity_arc(v, omega, round(HORIZON_S / STEP_S), STEP_S)
    first = np.inf
    for offset, radius in discs.tolist():
        heading = np.stack((np.cos(arc[:, 2]), np.sin(arc[:, 2])), axis=1)
        apart = np.linalg.norm(arc[:, :2] + offset * heading - point, axis=1)
        hit = (apart[:-1] <= radius) & (np.diff(apart) < 0)
        if hit.any():
            first = min(first, float(np.argmax(hit)) * STEP_S)
    return first


def is_clear_cut(v: float, omega: float, point: Floats, discs: Floats) -> bool:
    """Whether each disc over the point at the start plainly goes nearer to it, or away from it."""
    away = point - np.stack((discs[:, 0], 0 * discs[:, 0]), axis=1)
    apart = np.linalg.norm(away, axis=1)
    nearing = (v * away[:, 0] + omega * discs[:, 0] * away[:, 1]) / np.maximum(apart, 1e-9)
    return bool(np.all((apart > discs[:, 1] + 0.01) | ((apart > 0.05) & (abs(nearing) > 0.01))))


def seconds_of(velocity: tuple[float, float], point: tuple[float, float], body: Body) -> float:
    return float(free_way(np.array([velocity]), np.array([point]), body).seconds[0])


@settings(max_examples=150, deadline=None)
@given(
    v=st.floats(-1, 1),
    omega=st.one_of(st.just(0.0), st.floats(0.05, 1.5), st.floats(-1.5, -0.05)),
    x=st.floats(-3, 3),
    y=st.floats(-3, 3),
)
@pytest.mark.parametrize("shape", ["circumscribed", "row"])
def test_agrees_with_marching(shape: str, v: float, omega: float, x: float, y: float) -> None:
    assume(abs(v) > 0.02)
    body = body_discs(SPOT, BodySettings.model_validate({"shape": shape}))
    assume(is_clear_cut(v, omega, np.array([x, y]), body.discs))
    found = seconds_of((v, omega), (x, y), body)
    # A point that is grazed within the steps of the march may be seen by one of them alone.
    wider, narrower = (
        Body(body.discs + np.array([0, extra]), body.turning_radius) for extra in (0.004, -0.004)
    )
    late = marched(v, omega, np.array([x, y]), narrower.discs)
    early = marched(v, omega, np.array([x, y]), wider.discs)
    if found > HORIZON_S - 0.1:
        assert late >= HORIZON_S - 0.1
    else:
        assert early - 0.01 <= found <= late + 0.01


@pytest.mark.parametrize(
    ("velocity", "point", "seconds"),
    [
        ((0.5, 0.0), (2.5, 0.0), 4.0),
        ((0.5, 0.0), (2.5, 0.6), np.inf),
        ((0.5, 0.0), (-2.5, 0.0), np.inf),
        ((-0.5, 0.0), (-2.5, 0.0), 4.0),
        ((0.5, 0.0), (0.3, 0.0), 0.0),
        ((-0.5, 0.0), (0.3, 0.0), np.inf),
        ((0.0, 1.0), (0.3, 0.1), np.inf),
        ((0.0, 0.0), (2.0, 0.0), np.inf),
        # A quarter of a circle of 2 m, less the angle of a chord of half a metre.
        ((1.0, 0.5), (2.0, 2.0), np.pi - 2 * 2 * np.arcsin(0.125)),
        ((1.0, -0.5), (2.0, -2.0), np.pi - 2 * 2 * np.arcsin(0.125)),
        ((1.0, -0.5), (2.0, 2.0), np.inf),
    ],
)
def test_known_ways(
    velocity: tuple[float, float], point: tuple[float, float], seconds: float
) -> None:
    assert seconds_of(velocity, point, DISC) == pytest.approx(seconds)


def test_length_and_turn_belong_to_the_time() -> None:
    way = free_way(np.array([[0.5, 0.0], [1.0, 0.5]]), np.array([[2.5, 0.0]]), DISC)
    assert way.length[0] == pytest.approx(2.0)
    assert way.turn[0] == 0.0
    assert way.length[1] == pytest.approx(way.seconds[1])
    assert way.turn[1] == pytest.approx(way.seconds[1] / 2)


def test_nothing_in_the_way() -> None:
    way = free_way(np.array([[0.5, 0.1], [0.0, 0.5]]), np.empty((0, 2)), DISC)
    assert np.isinf([way.seconds, way.length, way.turn]).all()
    assert admissible(np.array([[0.5, 0.1], [0.0, 0.5]]), way, LIMITS).all()


def test_a_robot_that_fits_turns_whatever_its_discs_say() -> None:
    body = body_discs(SPOT, BodySettings())
    assert body.discs[-1].sum() > 0.65
    turn = np.array([[0.0, 0.5]])
    assert np.isinf(free_way(turn, np.array([[0.65, 0.01]]), body).seconds).all()
    assert free_way(turn, np.array([[0.55, 0.01]]), body).seconds == pytest.approx(0)


@given(v=st.floats(0.01, 2), way=st.floats(0, 5), reaction=st.floats(0, 1))
def test_admissible_is_what_stops_in_time(v: float, way: float, reaction: float) -> None:
    free = FreeWay(np.array([way / v]), np.array([way]), np.array([0.0]))
    needed = v * reaction + v**2 / (2 * LIMITS.linear_acceleration)
    assume(abs(needed - way) > 1e-9)
    admitted = admissible(np.array([[v, 0.0]]), free, LIMITS, reaction)
    assert bool(admitted[0]) == (needed < way)


def test_a_rotation_is_admissible_when_it_stops_before_the_contact() -> None:
    turns = np.array([[0.0, 1.0], [0.0, 1.0]])
    angle = 1.0 / (2 * LIMITS.yaw_acceleration)
    free = FreeWay(np.array([1.0, 1.0]), np.zeros(2), np.array([angle + 0.01, angle - 0.01]))
    assert admissible(turns, free, LIMITS).tolist() == [True, False]


@given(
    length=st.floats(0.2, 3),
    width=st.floats(0.2, 3),
    share=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
    count=st.integers(1, 6),
)
def test_discs_cover_the_rectangle(
    length: float, width: float, share: tuple[float, float], count: int
) -> None:
    footprint = Footprint(length=length, width=width)
    x, y = share[0] * length, share[1] * width
    for settings_ in (
        BodySettings(shape="circumscribed", margin=0),
        BodySettings(count=count, margin=0),
    ):
        body = body_discs(footprint, settings_)
        offset, radius = body.discs.T
        assert np.min(np.hypot(x - offset, y) - radius) <= 1e-9
        assert np.hypot(x, y) <= body.turning_radius + 1e-9
    inscribed = body_discs(footprint, BodySettings(shape="inscribed", margin=0)).discs[0]
    assert inscribed[1] == min(length, width) / 2
