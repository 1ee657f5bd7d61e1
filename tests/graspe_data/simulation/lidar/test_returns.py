"""Merging, detecting and choosing returns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.simulation.lidar.returns import choose_returns, least_energy, merge_echoes
from graspe_data.simulation.lidar.settings import LidarSettings

PULSE = 0.3
echo = st.tuples(
    st.floats(0.5, 3.0, width=32), st.one_of(st.just(0.0), st.floats(0.0625, 1.0, width=32))
)
beams = st.integers(1, 9).flatmap(
    lambda rays: st.lists(st.lists(echo, min_size=rays, max_size=rays), min_size=1, max_size=4)
)


def merged_one_by_one(beam: list[tuple[float, float]]) -> list[tuple[float, float]]:
    pulses: list[list[tuple[float, float]]] = []
    before = -np.inf
    for away, strength in sorted(beam):
        if away - before >= PULSE:
            pulses.append([])
        pulses[-1].append((away, strength))
        before = away
    energies = [sum(strength for _, strength in pulse) for pulse in pulses]
    moments = [sum(away * strength for away, strength in pulse) for pulse in pulses]
    both = zip(moments, energies, strict=True)
    return [(moment / energy, energy) if energy > 0 else (0.0, 0.0) for moment, energy in both]


@settings(deadline=None)
@given(beams)
def test_echoes_merge_as_they_do_one_by_one(given_beams: list[list[tuple[float, float]]]) -> None:
    values = np.array(given_beams, np.float32)
    away, energy = merge_echoes(values[..., 0], values[..., 1], PULSE)
    for row, beam in enumerate(given_beams):
        expected = merged_one_by_one(beam)
        found = list(zip(away[row], energy[row], strict=True))
        np.testing.assert_allclose(found[: len(expected)], expected, rtol=1e-6)
        assert not energy[row, len(expected) :].any()


@settings(deadline=None)
@given(beams)
def test_no_energy_is_lost_or_made(given_beams: list[list[tuple[float, float]]]) -> None:
    values = np.array(given_beams, np.float32)
    _, energy = merge_echoes(values[..., 0], values[..., 1], PULSE)
    np.testing.assert_allclose(energy.sum(axis=1), values[..., 1].sum(axis=1), rtol=1e-6)


def test_the_least_energy_grows_with_the_range_squared() -> None:
    settings = LidarSettings(faintest_share=0.1, minimum_range=0.4, maximum_range=100.0)
    away = np.array([0.3, 0.5, 25.0, 50.0, 100.0, 100.1])
    expected = [np.inf, 0.1 * 0.01**2, 0.025, 0.1, 0.4, np.inf]
    np.testing.assert_allclose(least_energy(away, settings), expected)


ENERGY = np.array([[0.2, 0.5, 0.3], [0.1, 0.2, 0.6], [0.0, 0.4, 0.0], [0.0, 0.0, 0.0]])


def reported(returns: str) -> list[list[float]]:
    mode = LidarSettings.model_validate({"returns": returns}).returns
    chosen, present = choose_returns(ENERGY, mode)
    strength = np.take_along_axis(ENERGY, chosen, axis=1)
    rows = zip(strength, present, strict=True)
    return [values[kept].tolist() for values, kept in rows]


@pytest.mark.parametrize(
    ("returns", "expected"),
    [
        ("strongest", [[0.5], [0.6], [0.4], []]),
        ("last", [[0.3], [0.6], [0.4], []]),
        ("dual", [[0.5, 0.3], [0.6, 0.2], [0.4], []]),
    ],
)
def test_returns_are_chosen_as_named(returns: str, expected: list[list[float]]) -> None:
    assert reported(returns) == expected
