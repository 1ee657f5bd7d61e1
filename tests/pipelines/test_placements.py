"""Which recordings are of one drive, and where that puts them."""

from __future__ import annotations

import hashlib
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from graspe_data.recordings.identity import ContentIdentity
from pipelines.dataset_settings import Group, SplitSettings
from pipelines.same_drives import DriveIdentity, find_links
from pipelines.splits import SplitPlacement, place_recordings

THIRDS = SplitSettings(train=0.5, validation=0.25, test=0.25)
SECOND = 1_000_000_000


def sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def measured(number: int, start: int, stop: int) -> ContentIdentity:
    """The content of some seconds of a drive, three fingerprints a second of each sensor."""
    prints = tuple(sorted(1000 * number + n for n in range(3 * start, 3 * stop)))
    return ContentIdentity(
        digest=sha(f"{number} {start} {stop}"),
        begin_ns=start * SECOND,
        end_ns=stop * SECOND,
        fingerprints={"image": prints, "points": tuple(5 * 10**6 + one for one in prints)},
    )


def drive(name: str, number: int, start: int = 0, stop: int = 60) -> DriveIdentity:
    return DriveIdentity(name, sha(name), measured(number, start, stop))


def placed(
    drives: list[DriveIdentity], settings: SplitSettings = THIRDS, seed: int = 0
) -> dict[str, SplitPlacement]:
    found = place_recordings(drives, settings, seed)
    return {
        one.name: place
        for one, place in zip(drives, found, strict=True)
        if isinstance(place, SplitPlacement)
    }


def test_an_overlap_is_in_one_group_whatever_the_seed() -> None:
    cuts = [drive("a", 1, 0, 40), drive("b", 1, 35, 70), drive("c", 1, 65, 99), drive("d", 2)]
    sides = set()
    for seed in range(200):
        found = placed(cuts, seed=seed)
        assert len({found[name].split for name in "abc"}) == 1
        sides.add((found["a"].split, found["d"].split))
    assert len(sides) == 9
    assert found["b"].linked == ("a", "c")
    assert {found[name].group for name in "abc"} == {min(d.identity for d in cuts[:3])[:12]}


def test_the_other_recordings_move_no_draw_but_of_what_overlaps_them() -> None:
    alone, other, cut = drive("a", 1), drive("b", 2), drive("c", 3, 0, 10)
    for seed in range(50):
        assert placed([alone], seed=seed)["a"] == placed([cut, other, alone], seed=seed)["a"]


@given(st.permutations(range(6)), st.integers(0, 1000))
def test_the_order_of_the_recordings_does_not_count(order: list[int], seed: int) -> None:
    drives = [
        drive("a", 1, 0, 40),
        drive("b", 1, 30, 60),
        drive("x", 2, 0, 20),
        drive("y", 2, 10, 30),
        drive("z", 2, 25, 40),
        drive("alone", 3),
    ]
    settings = THIRDS.model_copy(
        update={
            "groups": (
                Group(name="one", recordings=("x",), split="train"),
                Group(name="two", recordings=("z",), split="test"),
            )
        }
    )
    assert placed([drives[n] for n in order], settings, seed) == placed(drives, settings, seed)


def test_a_declared_group_takes_what_overlaps_it() -> None:
    groups = (Group(name="yard", recordings=("a*",), split="test"),)
    settings = THIRDS.model_copy(update={"groups": groups})
    found = placed([drive("a1", 1, 0, 30), drive("b", 1, 20, 50), drive("a2", 2)], settings)
    assert {name: (place.group, place.split) for name, place in found.items()} == {
        "a1": ("yard", "test"),
        "b": ("yard", "test"),
        "a2": ("yard", "test"),
    }


def test_groups_that_overlap_are_drawn_together() -> None:
    groups = (Group(name="yard", recordings=("a*",)), Group(name="field", recordings=("b*",)))
    settings = THIRDS.model_copy(update={"groups": groups})
    drives = [drive("a1", 1, 0, 30), drive("b1", 1, 20, 50), drive("a2", 2), drive("b2", 3)]
    for seed in range(100):
        found = placed(drives, settings, seed)
        assert len({place.split for place in found.values()}) == 1
    assert found["a2"].group == "yard"
    assert found["b2"].group == "field"


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_declared_groups_that_tear_an_overlap_refuse_the_later_name(order: tuple[int, ...]) -> None:
    groups = (
        Group(name="yard", recordings=("b",), split="train"),
        Group(name="field", recordings=("c",), split="test"),
    )
    settings = THIRDS.model_copy(update={"groups": groups})
    drives = [drive("b", 1, 0, 30), drive("c", 1, 20, 50), drive("a", 2)]
    given_drives = [drives[n] for n in order]
    found = place_recordings(given_drives, settings, seed=0)
    reason = found[given_drives.index(drives[1])]
    assert isinstance(reason, str)
    assert reason == (
        "c: holds the same measurements as b, but the declared groups field (test) and yard "
        "(train) put them in different splits. List both recordings in one group under "
        "split.groups, or leave one of them out."
    )
    assert set(placed(given_drives, settings)) == {"a", "b"}


def test_what_lies_between_two_declared_groups_is_what_is_refused() -> None:
    groups = (
        Group(name="yard", recordings=("x",), split="train"),
        Group(name="field", recordings=("y",), split="test"),
    )
    settings = THIRDS.model_copy(update={"groups": groups})
    drives = [drive("a", 1, 20, 50), drive("x", 1, 0, 30), drive("y", 1, 40, 70)]
    found = place_recordings(drives, settings, seed=0)
    assert isinstance(found[0], str)
    assert "a: holds the same measurements as" in found[0]
    assert set(placed(drives, settings)) == {"x", "y"}


def numbered(name: str, start: int, stop: int, files: tuple[str, ...] = ()) -> DriveIdentity:
    content = ContentIdentity(digest=sha(name), begin_ns=start * SECOND, end_ns=stop * SECOND)
    return DriveIdentity(name, sha(name), content, files or (name,))


@pytest.mark.parametrize(
    ("drives", "links"),
    [
        ([numbered("run_0.bag", 0, 9), numbered("run_2.bag", 99, 108)], 1),
        ([numbered("run_0.bag", 0, 9), numbered("run_1.bag", 99, 108)], 0),
        ([numbered("run_1.bag", 0, 9), numbered("run_3.bag", 99, 108)], 0),
        ([numbered("run_0.bag", 0, 9), numbered("run_1.bag", 9, 18)], 1),
        ([numbered("run_0.bag", 0, 9), numbered("run_1.bag", -50, -41)], 0),
        ([numbered("run_0.bag", 0, 9), numbered("walk_2.bag", 99, 108)], 0),
        ([numbered("2024-05-01.bag", 0, 9), numbered("2024-05-02.bag", 9, 18)], 0),
        ([numbered("r", 0, 9, ("r_0.db3", "r_1.db3")), numbered("r_3.db3", 99, 108)], 1),
        ([numbered("r", 0, 9, ("r_0.db3", "r_1.db3")), numbered("r_2.db3", 99, 108)], 0),
    ],
)
def test_recordings_between_which_a_part_is_missing_stay_together(
    drives: list[DriveIdentity], links: int
) -> None:
    assert len(find_links(drives)) == links
    assert len(find_links(drives[::-1])) == links


def test_the_links_are_those_of_every_pair_tried() -> None:
    random = np.random.default_rng(0)
    drives = []
    for number in range(40):
        start = int(random.integers(0, 300))
        drives.append(drive(f"d{number}", number % 5, start, start + int(random.integers(1, 40))))
    pairs = {
        (one, other)
        for one in range(40)
        for other in range(one + 1, 40)
        if drives[one].content.overlaps(drives[other].content)
    }
    assert {(link.one, link.other) for link in find_links(drives)} == pairs
    assert pairs
