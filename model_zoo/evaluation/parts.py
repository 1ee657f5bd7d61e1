"""The rows on which scores are looked at apart: by state, and by how soon they fail."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Mask
from graspe_data.observation.labels import AnchorState, steps_to_failure

NOT_FAILING: Final = "not_failing"
"""The primary figure: rows in which no failure is under way at the anchor."""
ALL_ROWS: Final = "all_rows"
WITHIN_A_SCENE: Final = "within_a_scene"
"""The candidates of each row among themselves, of rows that are not failing."""
STATES: Final = {state.name.lower(): state for state in AnchorState}
TIMES: Final = {
    "fails_within_1_s": (0.0, 1.0),
    "fails_in_1_to_2_s": (1.0, 2.0),
    "fails_after_2_s": (2.0, np.inf),
}
"""From and before, seconds from the anchor to the begin of the step that fails first."""
PARTS: Final = (NOT_FAILING, ALL_ROWS, *STATES, *TIMES)
TITLES: Final = {
    NOT_FAILING: "not failing yet",
    ALL_ROWS: "all rows",
    WITHIN_A_SCENE: "within a scene",
    **{name: name for name in STATES},
    "fails_within_1_s": "fails within 1 s",
    "fails_in_1_to_2_s": "fails in 1 to 2 s",
    "fails_after_2_s": "fails after 2 s",
}


def in_order(parts: Collection[str]) -> list[str]:
    """The names of parts in the order of tables."""
    return [part for part in (*PARTS, WITHIN_A_SCENE) if part in parts]


def part_mask(
    part: str, success: Mask, mask: Mask, state: NDArray[np.uint8], step_s: float
) -> Mask:
    """The judged steps of a part, bool (N, T).

    A time to failure holds the failing steps of the rows that fail in that time, against every
    succeeding step of all rows that are not failing yet.

    Args:
        part: One of :data:`PARTS`.
        success: bool (N, T).
        mask: bool (N, T), whether the step is judged.
        state: uint8 (N,), at the anchor.
        step_s: Length of a step, seconds.
    """
    sound: Mask = (state != AnchorState.FAILING)[:, None]
    if part == ALL_ROWS:
        return mask
    if part == NOT_FAILING:
        return mask & sound
    if part in STATES:
        own: Mask = (state == STATES[part])[:, None]
        return mask & own
    begin, end = TIMES[part]
    seconds = steps_to_failure(success, mask) * step_s
    due: Mask = ((seconds >= begin - _ROUNDING) & (seconds < end - _ROUNDING))[:, None]
    return mask & sound & (due | success)


_ROUNDING = 1e-9
