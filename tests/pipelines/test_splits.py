"""Splits are by group, declared or drawn; a draw depends on nothing but the group and the seed."""

from __future__ import annotations

import hashlib
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from graspe_data.errors import ManifestError
from graspe_data.manifest import validate
from pipelines.dataset_settings import Group, Split, SplitSettings
from pipelines.splits import split_of

THIRDS = SplitSettings(train=0.5, validation=0.3, test=0.2)
GROUPS = (
    Group(name="forest", recordings=("monday_*", "tuesday_[ab]"), split="test"),
    Group(name="street", recordings=("*.bag",)),
)


def digest(name: str) -> str:
    return hashlib.sha256(name.encode()).hexdigest()


def drawn(names: list[str], settings: SplitSettings = THIRDS, seed: int = 0) -> dict[str, Split]:
    return {name: split_of(name, digest(name), settings, seed)[1] for name in names}


NAMES = [f"drive_{number}" for number in range(4000)]


@pytest.mark.parametrize("shares", [(0.8, 0.1, 0.1), (0.5, 0.3, 0.2), (0.0, 0.25, 0.75)])
def test_over_many_recordings_the_shares_are_approached(shares: tuple[float, ...]) -> None:
    train, validation, test = shares
    settings = SplitSettings(train=train, validation=validation, test=test)
    counts: Counter[str] = Counter(drawn(NAMES, settings).values())
    for split, share in zip(("train", "validation", "test"), shares, strict=True):
        error = np.sqrt(share * (1 - share) * len(NAMES))
        assert counts[split] == pytest.approx(share * len(NAMES), abs=4 * error)


@pytest.mark.parametrize("only", ["train", "validation", "test"])
def test_a_share_of_one_takes_everything(only: str) -> None:
    shares = {"train": 0.0, "validation": 0.0, "test": 0.0} | {only: 1.0}
    assert set(drawn(NAMES, SplitSettings(**shares)).values()) == {only}


@given(st.lists(st.text(min_size=1), unique=True), st.lists(st.text(min_size=1), unique=True))
def test_a_recording_that_is_added_moves_none(some: list[str], more: list[str]) -> None:
    before, after = drawn(some), drawn(more + some)
    assert {name: after[name] for name in before} == before


def test_a_recording_in_no_group_is_its_own_whatever_it_is_called() -> None:
    group, split = split_of("drive", digest("content"), THIRDS, seed=0)
    assert split_of("renamed.bag", digest("content"), THIRDS, seed=0) == (group, split)
    groups = {split_of("drive", digest(name), THIRDS, seed=0)[0] for name in NAMES}
    assert len(groups) == len(NAMES)


def test_another_seed_draws_anew_and_the_same_one_draws_the_same() -> None:
    first, again, other = (drawn(NAMES, seed=seed) for seed in (0, 0, 1))
    assert first == again
    moved = np.mean([first[name] != other[name] for name in NAMES])
    assert moved == pytest.approx(1 - (0.25 + 0.09 + 0.04), abs=0.05)


@pytest.mark.parametrize("name", ["monday_1", "monday_", "tuesday_a", "monday_x.bag"])
def test_a_declared_split_is_taken(name: str) -> None:
    settings = SplitSettings(groups=GROUPS)
    assert split_of(name, digest(name), settings, seed=0) == ("forest", "test")


def test_a_group_stays_together_and_the_first_that_fits_counts() -> None:
    settings = THIRDS.model_copy(update={"groups": GROUPS})
    for seed in range(20):
        found = {split_of(f"{n}.bag", digest(f"{n}"), settings, seed) for n in range(50)}
        assert len(found) == 1
        assert next(iter(found))[0] == "street"


@pytest.mark.parametrize("name", ["Monday_1", "tuesday_c", "a.bag.active", "the_monday_1"])
def test_a_pattern_fits_the_whole_name_and_its_case(name: str) -> None:
    settings = SplitSettings(groups=GROUPS)
    assert split_of(name, digest(name), settings, 0)[0] not in {"forest", "street"}


def test_declaring_groups_moves_none_of_the_others() -> None:
    settings = THIRDS.model_copy(update={"groups": GROUPS})
    assert drawn(NAMES, settings) == drawn(NAMES)


def test_a_group_is_declared_once() -> None:
    groups = [
        {"name": "forest", "recordings": ["a*"], "split": "train"},
        {"name": "street", "recordings": ["b*"]},
        {"name": "forest", "recordings": ["c*"], "split": "test"},
    ]
    with pytest.raises(ManifestError, match="forest is declared twice"):
        validate({"groups": groups}, SplitSettings, "mine.yaml")


@pytest.mark.parametrize("shares", [(0.8, 0.1, 0.2), (0.5, 0.1, 0.1), (0.0, 0.0, 0.0)])
def test_shares_make_a_whole(shares: tuple[float, float, float]) -> None:
    train, validation, test = shares
    with pytest.raises(ValidationError, match=r"train \+ validation \+ test is .*, and must be 1"):
        SplitSettings(train=train, validation=validation, test=test)
