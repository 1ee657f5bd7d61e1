"""Balance and histograms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from graspe_data.columns import Column
from graspe_data.observation.labels.anchor_state import AnchorState
from graspe_data.shards.dataset_index import (
    read_index,
)
from pipelines.report import balance, histograms
from tests.pipelines.report.conftest import notices_of, stored_rows


def test_balance_counts_rows_and_steps(dataset: Path) -> None:
    found = balance.split_balance(dataset, read_index(dataset), "train")
    assert found.whole == balance.Balance(
        rows=12,
        rows_failing=3,
        rows_unjudged=1,
        steps=120,
        steps_failing=15,
        steps_succeeding=95,
    )
    assert found.recordings == {0: found.whole}
    assert found.valid == {"image_valid": 12, "points_valid": 12, "odometry_valid": 12}
    assert [found.states[state] for state in AnchorState] == [3, 1, 0, 8]


def test_histograms_count_every_row_once(dataset: Path) -> None:
    quantities = (
        histograms.Quantity("r_img", "", limits=(0, 1)),
        histograms.Quantity("points_age_ns", "", unit=1e6),
        histograms.Quantity("odometry_age_ns", "", unit=1e6),
    )
    for made in histograms.histograms(dataset, ("train", "validation"), quantities):
        assert made.counts["train"].sum() == 12
        assert made.counts["validation"].sum() == 5
    ages = histograms.histograms(dataset, ("train",), quantities)[1]
    assert (ages.edges[0], ages.edges[-1]) == (0, 110)


def test_every_scalar_with_a_unit_is_drawn(dataset: Path) -> None:
    columns = read_index(dataset).columns
    mean = Column(
        name="mean_range", dtype="float32", shape=(), unit="m", frame="", meaning="x; y", stage="s"
    )
    drawn = {q.column: q for q in histograms.measured_quantities((*columns, mean))}
    assert {"r_img", "r_edge", "point_count", "points_age_ns", "mean_range"} <= drawn.keys()
    assert drawn.keys().isdisjoint({"stamp_ns", "state", "recording", "image", "image_valid"})
    assert list(drawn["r_img"].limits or ()) == [0, 1]
    assert (drawn["points_age_ns"].unit, drawn["mean_range"].label) == (1e6, "mean_range: x")


@pytest.mark.parametrize(("age_ms", "ends"), [(0.0, (-1, 1)), (0.3, (-1, 2)), (30.0, (28.5, 31.5))])
def test_ages_that_are_all_one_lie_inside_a_readable_axis(
    tmp_path: Path, age_ms: float, ends: tuple[float, float]
) -> None:
    rows = stored_rows(8, 0, failing=1) | {"odometry_age_ns": np.full(8, round(age_ms * 1e6))}
    notices_of(tmp_path, rows)
    age = histograms.Quantity("odometry_age_ns", "", unit=1e6, room=1)
    (made,) = histograms.histograms(tmp_path, ("train",), (age,))
    assert (made.edges[0], made.edges[-1]) == pytest.approx(ends)
    occupied = int(made.counts["train"].argmax())
    assert made.counts["train"][occupied] == 8
    assert made.edges[occupied] <= age_ms <= made.edges[occupied + 1]
