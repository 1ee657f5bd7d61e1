"""What came of the maps of one trial, as it is written to its file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from graspe_data.manifest import Settings

Count = Annotated[int, Field(ge=0)]


class MapScore(Settings):
    """How right the maps were that a planner drove by, and how long each took.

    The shares are those of the cells of all compared maps together; see ``count_cells``.

    Attributes:
        maps: How many were compared with the world.
        called: Cells that the maps held for solid.
        right: Of those, how many are barred in the world.
        there: Cells that are barred in the world and can be seen.
        found: Of those, how many the maps held for solid.
        precision: right / called; None where there is none.
        recall: found / there.
        f_score: Harmonic mean of both.
        median_ms: Wall clock from a cloud to its map, over all maps.
    """

    maps: Count
    called: Count
    right: Count
    there: Count
    found: Count
    precision: float | None
    recall: float | None
    f_score: float | None
    median_ms: Annotated[float, Field(ge=0)]
