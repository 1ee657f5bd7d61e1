from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from graspe_data.errors import ZooError
from model_zoo.resampling import rows_for_training, rows_with_failure


def any_failure(successes: int, failures: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    rows = np.zeros(successes + failures, np.bool_)
    rows[:failures] = True
    return np.random.default_rng(0).permutation(rows)


def test_paads_published_counts() -> None:
    rows = rows_for_training(any_failure(27_034, 2_258))
    assert len(rows) == 9_923
    assert math.ceil(len(rows) / 16) == 621


def test_graspes_counts_leave_no_under_sampling() -> None:
    rows = rows_for_training(any_failure(28_721, 8_463))
    assert len(rows) == 45_647
    assert math.ceil(len(rows) / 16) == 2_853


@given(arrays(np.bool_, array_shapes(min_dims=1, max_dims=1, max_side=300)))
def test_each_failure_comes_as_it_is_and_mirrored_and_a_success_once_at_most(
    fails: np.ndarray[tuple[int], np.dtype[np.bool_]],
) -> None:
    if not fails.any():
        with pytest.raises(ZooError, match="none of"):
            rows_for_training(fails)
        return
    rows = rows_for_training(fails)
    plain, mirrored = rows.indices[~rows.mirrored], rows.indices[rows.mirrored]
    assert mirrored.tolist() == np.flatnonzero(fails).tolist()
    assert np.unique(plain).tolist() == plain.tolist()
    assert set(np.flatnonzero(fails)) <= set(plain)
    assert np.count_nonzero(~fails[plain]) >= int(not fails.all())


@given(st.integers(0, 5000), st.integers(1, 500))
def test_under_sampling_brings_the_successes_near_the_failures(ok: int, failed: int) -> None:
    rows = rows_for_training(any_failure(ok, failed))
    kept = len(rows) - 2 * failed
    assert kept <= ok
    assert kept <= 4 * failed or ok == kept


def test_only_judged_steps_make_a_failure() -> None:
    success = np.array([[1, 1, 0], [1, 1, 0], [1, 1, 1]], np.uint8)
    mask = np.array([[1, 1, 1], [1, 1, 0], [1, 1, 1]], np.bool_)
    assert rows_with_failure(success, mask).tolist() == [True, False, False]
