"""What a report draws attention to."""

from __future__ import annotations

from pathlib import Path

import pytest

from graspe_data.shards.dataset_index import RecordingEntry
from tests.pipelines.report.conftest import notices_of, stored_rows


@pytest.mark.parametrize(("shown", "noticed"), [(5, True), (6, True), (7, False)])
def test_empty_trajectory_images_are_told_from_a_quarter_on(
    tmp_path: Path, shown: int, *, noticed: bool
) -> None:
    rows = stored_rows(8, 0, failing=1)
    rows["trajectory_image"][:shown, -1, -1] = 1
    expected = (
        f"The trajectory image is empty in {8 - shown} of 8 rows of train: the arc ends before "
        "the picture's ground begins, or runs beside it. Lengthen the horizon, drive faster, or "
        "draw it as from behind the camera: `trajectory_image: {behind: 1.0}` in the dataset's "
        "manifest."
    )
    assert notices_of(tmp_path, rows) == ([expected] if noticed else [])


def test_where_the_robot_stands_no_longer_horizon_is_advised(tmp_path: Path) -> None:
    found = notices_of(tmp_path, stored_rows(8, 0, failing=1, speed=0.0))
    empty = "The trajectory image is empty in 8 of 8 rows of train"
    assert found == [f"{empty}; in 8 of them the robot stands."]


def test_recordings_of_one_drive_are_named_and_are_no_refusals(tmp_path: Path) -> None:
    rows = stored_rows(8, 0, failing=1)
    rows["trajectory_image"][:, -1, -1] = 1
    twin = RecordingEntry(
        name="b.bag", digest="", group="b", details={"refused": "it", "counted_as": "b"}
    )
    cut = RecordingEntry(name="c", digest="", group="a", details={"overlaps": ["a", "d"]})
    assert notices_of(tmp_path, rows, twin, cut) == [
        "b.bag is the same drive as b; it counts once.",
        "c is of one drive with a, d; they are in one split.",
    ]
