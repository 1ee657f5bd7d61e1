"""Dust and near leaves before a lidar: nearer, fainter, never through what stands before them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.sensor_failures import Dust, MetReturns, NearLeaves, meet_dust, meet_leaves
from graspe_data.sensor_failures.beams import LEAF_DISTANCE, LEAF_TILT, Beams

AZIMUTH, ELEVATION = np.meshgrid(
    np.linspace(-np.pi, np.pi, 720, endpoint=False), np.radians(np.arange(-15.0, 16.0, 2.0))
)
DIRECTION = np.stack(
    [np.cos(ELEVATION) * np.cos(AZIMUTH), np.cos(ELEVATION) * np.sin(AZIMUTH), np.sin(ELEVATION)],
    axis=-1,
).reshape(-1, 3)
DIRECTION = DIRECTION.astype(np.float32)
AHEAD = np.abs(AZIMUTH.ravel()) < np.pi / 2
Meet = Callable[[Beams, Beams, float, int], MetReturns]


def dust(direction: Beams, distance: Beams, strength: float, seed: int) -> MetReturns:
    return meet_dust(direction, distance, Dust(strength, seed))


def leaves(direction: Beams, distance: Beams, share: float, seed: int) -> MetReturns:
    return meet_leaves(direction, distance, NearLeaves(share, seed))


BOTH = pytest.mark.parametrize("meet", [dust, leaves])


def at(metres: float) -> Beams:
    return np.full(len(DIRECTION), metres, np.float32)


@BOTH
def test_nothing_happens_at_0(meet: Meet) -> None:
    found = meet(DIRECTION, at(6.0), 0.0, 1)
    assert not found.met.any()
    assert (found.distance == 6).all()
    assert (found.brightness == 1).all()
    assert (found.roughness == 0).all()


@BOTH
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), strength=st.floats(0.1, 1), metres=st.floats(0.3, 60))
def test_what_is_met_lies_before_what_was_there(
    meet: Meet, seed: int, strength: float, metres: float
) -> None:
    there = at(metres)
    found = meet(DIRECTION, there, strength, seed)
    assert (found.distance[found.met] < there[found.met]).all()
    assert (found.distance[~found.met] == there[~found.met]).all()
    assert (found.distance > 0.4 if metres > 0.46 else ~found.met).all()
    assert (found.roughness > 0).tolist() == found.met.tolist()
    again = meet(DIRECTION, there, strength, seed)
    np.testing.assert_array_equal(found.distance, again.distance)


def test_dust_is_faint_clustered_and_denser_when_stronger() -> None:
    shares = []
    for strength in (0.2, 0.5, 1.0):
        found = [meet_dust(DIRECTION, at(8.0), Dust(strength, seed)) for seed in range(12)]
        shares.append(float(np.mean([each.met.mean() for each in found])))
        bright = np.concatenate([each.brightness[each.met] for each in found])
        assert 0.04 < np.median(bright) < 0.16
    assert shares == sorted(shares)
    assert 0.15 < shares[-1] < 0.8
    # In puffs: sectors of a tenth of a turn differ far more than by chance.
    by_sector = [each.met.reshape(16, 10, 72).mean(axis=(0, 2)) for each in found]
    assert np.mean([np.ptp(each) for each in by_sector]) > 0.2


def test_dust_behind_a_wall_is_not_seen() -> None:
    near = meet_dust(DIRECTION, at(0.9), Dust(1.0, 3)).met.mean()
    assert near < 0.2 * meet_dust(DIRECTION, at(9.0), Dust(1.0, 3)).met.mean()


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_leaves_hide_their_share_of_what_is_ahead_and_nothing_behind(share: float) -> None:
    found = [meet_leaves(DIRECTION, at(6.0), NearLeaves(share, seed)) for seed in range(6)]
    hidden = float(np.mean([each.met[AHEAD].mean() for each in found]))
    assert hidden == pytest.approx(share, abs=0.08)
    behind = np.abs(AZIMUTH.ravel()) > np.pi / 2 + 0.12
    assert not any(each.met[behind].any() for each in found)
    low, high = LEAF_DISTANCE
    distances = np.concatenate([each.distance[each.met] for each in found])
    assert distances.min() >= low * (1 - LEAF_TILT)
    assert distances.max() <= high * (1 + LEAF_TILT)


@BOTH
def test_what_happens_to_a_beam_does_not_depend_on_the_others(meet: Meet) -> None:
    some = np.random.default_rng(0).permutation(len(DIRECTION))[:3000]
    whole, part = meet(DIRECTION, at(6.0), 0.8, 9), meet(DIRECTION[some], at(6.0)[some], 0.8, 9)
    for name in ("met", "distance", "brightness", "roughness"):
        np.testing.assert_array_equal(getattr(whole, name)[some], getattr(part, name))


@BOTH
def test_the_length_of_a_direction_means_nothing(meet: Meet) -> None:
    one, other = (meet(DIRECTION * np.float32(k), at(6.0), 0.7, 4) for k in (1, 4))
    np.testing.assert_array_equal(one.met, other.met)


@BOTH
def test_a_beam_that_met_nothing_can_meet_this(meet: Meet) -> None:
    found = meet(DIRECTION, at(np.inf), 1.0, 2)
    assert np.isfinite(found.distance[found.met]).all()
    assert found.met.mean() > 0.1
