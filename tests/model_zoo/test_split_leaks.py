"""What stands on both sides of a split is refused, whatever tells it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from graspe_data.errors import ZooError
from graspe_data.shards.dataset_index import RecordingEntry
from model_zoo.split_leaks import check_apart


def recordings(*entries: tuple[str, str, str, dict[str, Any]]) -> list[RecordingEntry]:
    return [
        RecordingEntry(name=name, digest=digest, group="", split=split, rows=3, details=details)
        for name, split, digest, details in entries
    ]


A, B = "a" * 64, "b" * 64


@pytest.mark.parametrize("earlier", ["train", "validation"])
@pytest.mark.parametrize(
    ("one", "other", "shared"),
    [
        ((A, {}), (A, {}), "bytes"),
        ((A, {"content": "c" * 64}), (B, {"content": "c" * 64}), "content"),
        ((A, {"overlaps": ["tested.bag"]}), (B, {"overlaps": ["taught.bag"]}), "drive"),
        ((A, {"world": "garden, seed 3"}), (B, {"world": "garden, seed 3"}), "world"),
    ],
)
def test_a_leak_is_refused_by_both_names(
    earlier: str,
    one: tuple[str, dict[str, Any]],
    other: tuple[str, dict[str, Any]],
    shared: str,
) -> None:
    found = recordings(("taught.bag", earlier, *one), ("tested.bag", "test", *other))
    message = (
        rf"tested\.bag of the split 'test' and taught\.bag .*'{earlier}' have the same {shared}"
    )
    with pytest.raises(ZooError, match=message):
        check_apart(found, found, "test", Path("data"))


def test_what_shares_nothing_passes() -> None:
    found = recordings(
        ("a.bag", "train", A, {"content": "c" * 64, "world": "garden, seed 3"}),
        ("b.bag", "test", B, {"content": "d" * 64, "world": "garden, seed 4"}),
    )
    check_apart(found, found, "test", Path("data"))


def test_a_split_is_held_against_those_before_it() -> None:
    found = recordings(("a.bag", "train", A, {}), ("b.bag", "validation", A, {}))
    check_apart(found, found, "train", Path("data"))
    with pytest.raises(ZooError, match="have the same bytes"):
        check_apart(found, found, "validation", Path("data"))


def test_another_dataset_teaches() -> None:
    taught, tested = recordings(("a.bag", "train", A, {})), recordings(("b.bag", "test", A, {}))
    check_apart(tested, tested, "test", Path("data"))
    with pytest.raises(ZooError, match=r"b\.bag .* and a\.bag"):
        check_apart(taught, tested, "test", Path("data"))
