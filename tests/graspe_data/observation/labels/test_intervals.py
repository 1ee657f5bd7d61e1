"""Runs, joined intervals and overlaps against one-line references."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.observation.labels.events import join_intervals, touches, true_runs
from graspe_data.observation.labels.motion_series import moving_mean

Pairs = list[tuple[int, int]]
pairs = st.lists(
    st.tuples(st.integers(0, 60), st.integers(0, 12)).map(lambda pair: (pair[0], sum(pair))),
    max_size=12,
)


def columns(of: Pairs) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    array = np.array(of, np.int64).reshape(-1, 2)
    return array[:, 0], array[:, 1]


@given(pairs, st.lists(st.integers(-5, 80), min_size=1, max_size=20), st.integers(0, 9))
def test_touching_is_meeting_the_half_open_span(of: Pairs, after: list[int], width: int) -> None:
    starts, stops = columns(of)
    begin = np.array(after, np.int64)
    expected = [any(s <= a + width and t > a for s, t in of) for a in after]
    assert touches(starts, stops, begin, begin + width).tolist() == expected


@given(pairs, st.integers(0, 4))
def test_joined_intervals_cover_the_same_instants_and_lie_apart(of: Pairs, join: int) -> None:
    starts, stops = join_intervals(*columns(of), join)
    covered = {instant for s, t in of for instant in range(s, t + 1)}
    joined = {instant for s, t in zip(starts, stops, strict=True) for instant in range(s, t + 1)}
    assert covered <= joined
    assert np.all(starts[1:] > stops[:-1] + join)
    assert set(starts.tolist()) <= {s for s, _ in of}
    assert set(stops.tolist()) <= {t for _, t in of}
    if join == 0:
        assert covered == joined


@given(st.lists(st.booleans(), max_size=30), st.integers(1, 3))
def test_runs_are_the_true_stretches_without_gaps(mask: list[bool], gap: int) -> None:
    rng = np.random.default_rng(len(mask))
    stamps = np.cumsum(rng.integers(1, 5, len(mask))).astype(np.int64)
    runs: list[list[int]] = []
    for i, true in enumerate(mask):
        if true and runs and runs[-1][1] == i - 1 and stamps[i] - stamps[i - 1] <= gap:
            runs[-1][1] = i
        elif true:
            runs.append([i, i])
    first, last = true_runs(np.array(mask, np.bool_), stamps, gap)
    assert [list(run) for run in zip(first, last, strict=True)] == runs


@given(st.lists(st.tuples(st.integers(1, 9), st.floats(-9, 9)), min_size=1, max_size=30))
def test_the_moving_mean_is_the_mean_of_the_window(samples: list[tuple[int, float]]) -> None:
    steps, values = zip(*samples, strict=True)
    stamps, column = np.cumsum(np.array(steps, np.int64)), np.array(values)
    expected = [column[(stamps >= stamp - 6) & (stamps <= stamp + 3)].mean() for stamp in stamps]
    mean = moving_mean(stamps * 10**9, column, 6.0, 3.0)
    np.testing.assert_allclose(mean, expected, atol=1e-9)
