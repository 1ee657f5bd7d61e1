"""One process at a time in a folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from graspe_data.errors import FileError, ZooError
from graspe_data.folder_lock import hold_folder


def test_a_held_folder_is_refused_until_it_is_let_go(tmp_path: Path) -> None:
    with hold_folder(tmp_path, "building", FileError):
        refused = pytest.raises(FileError, match=f"{tmp_path}: another process is building here")
        with refused, hold_folder(tmp_path, "building", FileError):
            pass
    with hold_folder(tmp_path, "building", FileError):
        assert list(tmp_path.iterdir()) == []


def test_a_note_tells_who_holds_it(tmp_path: Path) -> None:
    with (
        hold_folder(tmp_path, "training", ZooError, ".lock"),
        pytest.raises(ZooError, match=f"process {os.getpid()} on .* is training here"),
        hold_folder(tmp_path, "training", ZooError, ".lock"),
    ):
        pass


def test_a_child_does_not_hold_what_its_parent_held(tmp_path: Path) -> None:
    begun, begin = os.pipe()
    ended, end = os.pipe()
    with hold_folder(tmp_path, "training", ZooError, ".lock"):
        child = os.fork()
        if child == 0:
            os.write(begin, b"x")
            os.close(end)
            os.read(ended, 1)
            os._exit(0)
        os.read(begun, 1)
    with hold_folder(tmp_path, "training", ZooError, ".lock"):
        os.close(end)
        os.waitpid(child, 0)
    for pipe in (begun, begin, ended):
        os.close(pipe)


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with (
        pytest.raises(FileError, match="absent: cannot be opened: No such file"),
        hold_folder(tmp_path / "absent", "building", FileError),
    ):
        pass
