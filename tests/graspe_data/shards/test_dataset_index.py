from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from graspe_data.errors import ShardError
from graspe_data.shards.dataset_index import (
    DatasetIndex,
    RecordingEntry,
    read_index,
    write_index,
)


def rewrite(folder: Path, change: Callable[[Any], None]) -> None:
    """Change ``dataset.json`` as a hostile hand would, with a digest that fits."""
    path = folder / "dataset.json"
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def test_an_index_comes_back_as_written(dataset_path: Path, tmp_path: Path) -> None:
    index = read_index(dataset_path)
    assert write_index(tmp_path, index) == index == read_index(tmp_path)
    first, second = (folder / "dataset.json" for folder in (dataset_path, tmp_path))
    assert first.read_bytes() == second.read_bytes()


def test_the_file_has_sorted_keys_and_ends_in_a_line(dataset_path: Path) -> None:
    text = (dataset_path / "dataset.json").read_text()
    assert text == json.dumps(json.loads(text), indent=2, sort_keys=True) + "\n"


@pytest.mark.parametrize(
    "change",
    [
        {"order_seed": 1},
        {"configuration": {"rate": 5}},
        {"group_key": "place"},
        {"columns": ()},
    ],
)
def test_what_decides_rows_and_order_changes_the_digest(
    dataset_path: Path, change: dict[str, Any]
) -> None:
    index = read_index(dataset_path)
    assert index.model_copy(update=change).content_digest() != index.dataset_digest


@pytest.mark.parametrize(
    "change",
    [
        {"storage": {"rows_per_shard": 1}},
        {"statistics": {"mean": 0.5}},
        {"name": "renamed"},
        {"splits": {}},
        {"losses": {"no cloud": 3}},
    ],
)
def test_what_does_not_leaves_it(dataset_path: Path, change: dict[str, Any]) -> None:
    index = read_index(dataset_path)
    assert index.model_copy(update=change).content_digest() == index.dataset_digest


def test_recordings_count_by_content_not_by_name(dataset_path: Path) -> None:
    index = read_index(dataset_path)

    def digest(**change: Any) -> str:
        entry = index.recordings[0].model_copy(update=change)
        return index.model_copy(update={"recordings": [entry]}).content_digest()

    assert digest(name="moved.bag", losses={"no cloud": 1}) == index.dataset_digest
    for change in ({"digest": "0" * 64}, {"group": "x"}, {"columns": {"points": "1" * 64}}):
        assert digest(**change) != index.dataset_digest


def test_a_missing_manifest_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(ShardError, match=r"no finished dataset.*graspe dataset build"):
        read_index(tmp_path)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "\0", "NaN", '"text"', "[]"])
def test_what_is_no_manifest_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "dataset.json").write_text(text)
    with pytest.raises(ShardError, match=r"dataset\.json"):
        read_index(tmp_path)


@pytest.mark.parametrize(
    "path", ["../up.npz", "/etc/passwd", "a/../../b", "./a", "a//b", "", "a\\b", "a\0b", "."]
)
def test_paths_that_leave_the_folder_are_refused(dataset_path: Path, path: str) -> None:
    def change(content: Any) -> None:
        content["splits"]["train"][0]["path"] = path

    rewrite(dataset_path, change)
    with pytest.raises(ShardError, match=r"splits\.train\.0\.path"):
        read_index(dataset_path)


def test_an_unknown_key_suggests_the_nearest(dataset_path: Path) -> None:
    rewrite(dataset_path, lambda content: content.update(statistic={}))
    with pytest.raises(ShardError, match=r"statistic: unknown key\. Did you mean 'statistics'"):
        read_index(dataset_path)


@pytest.mark.parametrize("dtype", ["object", "O", "V10", "U5", "float128", "i4,f4", "datetime64"])
def test_columns_are_numbers(dataset_path: Path, dtype: str) -> None:
    rewrite(dataset_path, lambda content: content["columns"][0].update(dtype=dtype))
    with pytest.raises(ShardError, match="not a number"):
        read_index(dataset_path)


def test_rows_of_shards_and_recordings_must_agree(dataset_path: Path) -> None:
    rewrite(dataset_path, lambda content: content["recordings"][0].update(rows=22))
    with pytest.raises(ShardError, match="has 23 rows in its shards, 22 by its recordings"):
        read_index(dataset_path)


def test_not_a_number_in_the_statistics_is_refused(tmp_path: Path) -> None:
    index = DatasetIndex(
        name="x",
        columns=(),
        group_key="day",
        splits={},
        recordings=[RecordingEntry(name="a.bag", digest="", group="")],
    )
    with pytest.raises(ShardError, match="store null"):
        write_index(tmp_path, index.model_copy(update={"statistics": {"mean": float("nan")}}))
