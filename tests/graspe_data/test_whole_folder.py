"""A folder appears whole or not at all, and what killed processes leave behind goes."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from graspe_data.atomic_file import partial_path
from graspe_data.errors import FileError
from graspe_data.folder_lock import hold_folder
from graspe_data.whole_folder import replaced_folder, sweep, whole_folder, workplace

Way = Callable[[Path], AbstractContextManager[Path]]


def test_a_folder_appears_when_its_block_ends(tmp_path: Path) -> None:
    target = tmp_path / "stages" / "label"
    with whole_folder(target) as made:
        (made / "a").write_text("a")
        assert not target.exists()
    assert (target / "a").read_text() == "a"
    assert [path.name for path in target.parent.iterdir()] == ["label"]


@pytest.mark.parametrize("way", [whole_folder, replaced_folder])
def test_an_error_on_the_way_leaves_nothing(tmp_path: Path, way: Way) -> None:
    with pytest.raises(FileNotFoundError), way(tmp_path / "target") as made:
        (made / "absent" / "a").write_text("a")
    assert list(tmp_path.iterdir()) == []


def test_the_same_folder_by_another_process_stays(tmp_path: Path) -> None:
    with whole_folder(tmp_path / "target") as made:
        (made / "a").write_text("mine")
        (tmp_path / "target").mkdir()
        (tmp_path / "target" / "a").write_text("theirs")
    assert (tmp_path / "target" / "a").read_text() == "theirs"


def test_a_folder_is_replaced_by_a_whole_one(tmp_path: Path) -> None:
    target = tmp_path / "target"
    for content in ("before", "after"):
        with replaced_folder(target) as made:
            (made / content).write_text(content)
    assert [path.name for path in target.iterdir()] == ["after"]
    assert list(tmp_path.iterdir()) == [target]


def test_a_workplace_is_gone_afterwards_and_those_of_killed_processes_too(tmp_path: Path) -> None:
    target = tmp_path / "drive[1].bag"
    killed, working = partial_path(target), partial_path(target)
    killed.mkdir()
    working.mkdir()
    with hold_folder(working, "at work", FileError), workplace(target) as folder:
        assert sorted(tmp_path.iterdir()) == sorted((folder, working))
    assert list(tmp_path.iterdir()) == [working]


def test_sweeping_takes_half_made_files_and_folders(tmp_path: Path) -> None:
    (tmp_path / "episode").mkdir()
    (tmp_path / "episode" / "kept").write_text("kept")
    partial_path(tmp_path / "episode" / "label").mkdir()
    partial_path(tmp_path / "dataset.json").write_text("half")
    sweep(tmp_path)
    assert [path.name for path in tmp_path.rglob("*")] == ["episode", "kept"]
