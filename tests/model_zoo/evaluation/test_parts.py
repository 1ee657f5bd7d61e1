"""Which steps a part of the rows has."""

from __future__ import annotations

import numpy as np
import pytest

from model_zoo.evaluation.parts import PARTS, STATES, part_mask

FAILING, STANDING, BACKING, DRIVING = range(4)
STATE = np.array([FAILING, STANDING, BACKING, DRIVING, DRIVING], np.uint8)
# Steps of 0.5 s; the rows fail at once, after 0.5 s, after 1 s, after 2 s and never.
FAILS_FROM = np.array([0, 1, 2, 4, 6])
SUCCESS = np.arange(6) < FAILS_FROM[:, None]
MASK = np.ones((5, 6), bool)


def rows_and_steps(part: str) -> list[int]:
    """Judged steps of each row."""
    return [int(count) for count in part_mask(part, SUCCESS, MASK, STATE, 0.5).sum(axis=1)]


@pytest.mark.parametrize(
    ("part", "judged"),
    [
        ("not_failing", [0, 6, 6, 6, 6]),
        ("all_rows", [6, 6, 6, 6, 6]),
        ("failing", [6, 0, 0, 0, 0]),
        ("standing", [0, 6, 0, 0, 0]),
        ("backing", [0, 0, 6, 0, 0]),
        ("driving", [0, 0, 0, 6, 6]),
        # All steps of the rows that fail in that time, of the others those that succeed.
        ("fails_within_1_s", [0, 6, 2, 4, 6]),
        ("fails_in_1_to_2_s", [0, 1, 6, 4, 6]),
        ("fails_after_2_s", [0, 1, 2, 6, 6]),
    ],
)
def test_a_part_has_its_steps(part: str, judged: list[int]) -> None:
    assert rows_and_steps(part) == judged


def test_every_state_has_a_part() -> None:
    assert list(STATES) == ["failing", "standing", "backing", "driving"]
    assert set(STATES) < set(PARTS)


def test_steps_that_nobody_judged_are_in_no_part() -> None:
    for part in PARTS:
        assert not part_mask(part, SUCCESS, ~MASK, STATE, 0.5).any()
