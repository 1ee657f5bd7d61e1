"""Column files: the digest is that of the file, in whatever order its rows were written."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

from graspe_data.columns import Column
from pipelines.episode import EpisodeWriter

COLUMN = Column(
    name="points",
    dtype="float32",
    shape=(4, 3),
    unit="m",
    frame="base_link",
    meaning="points",
    stage="extract",
)
ROWS = 6


@pytest.mark.parametrize("kept", [None, [0, 1, 2], [1, 5], []], ids=str)
@pytest.mark.parametrize(
    "order",
    [[0, 1, 2, 3, 4, 5], [1, 0, 2, 3, 4, 5], [0, 1, 1, 2, 3, 4, 5], [0, 1, 2], [0, 1, 4, 5], []],
    ids=str,
)
def test_digests_are_those_of_the_files(
    tmp_path: Path, order: list[int], kept: list[int] | None
) -> None:
    values = np.random.default_rng(0).random((len(order), 4, 3), np.float32)
    expected = np.zeros((ROWS, 4, 3), np.float32)
    with EpisodeWriter(tmp_path, [COLUMN], ROWS) as writer:
        for row, value in zip(order, values, strict=True):
            writer.write(row, {"points": value})
            expected[row] = value
        if kept is not None:
            writer.keep(np.array(kept, np.intp))
            expected = expected[kept]
        digests = writer.digests()
    path = tmp_path / "points.npy"
    assert digests == {"points": hashlib.sha256(path.read_bytes()).hexdigest()}
    np.testing.assert_array_equal(np.load(path), expected)


def test_a_column_written_at_once_is_hashed_alike(tmp_path: Path) -> None:
    with EpisodeWriter(tmp_path, [COLUMN], ROWS) as writer:
        writer.write_all("points", np.arange(ROWS * 12, dtype=np.float32).reshape(ROWS, 4, 3))
        found = writer.digests()["points"]
    assert found == hashlib.sha256((tmp_path / "points.npy").read_bytes()).hexdigest()
