from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings import recording_digest


def test_a_file_has_the_digest_of_its_content(tmp_path: Path) -> None:
    (tmp_path / "a.bag").write_bytes(b"bag")
    assert recording_digest(tmp_path / "a.bag") == hashlib.sha256(b"bag").hexdigest()


def test_a_folder_has_the_digest_of_its_names_and_contents(tmp_path: Path) -> None:
    (tmp_path / "b.mcap").write_bytes(b"second")
    (tmp_path / "a.mcap").write_bytes(b"first")
    lines = (
        f"a.mcap {hashlib.sha256(b'first').hexdigest()}\n"
        f"b.mcap {hashlib.sha256(b'second').hexdigest()}\n"
    )
    assert recording_digest(tmp_path) == hashlib.sha256(lines.encode()).hexdigest()


def test_a_moved_recording_keeps_its_digest_and_a_changed_one_does_not(tmp_path: Path) -> None:
    folder = tmp_path / "drive"
    folder.mkdir()
    (folder / "a.db3").write_bytes(b"rows")
    before = recording_digest(folder)
    moved = folder.rename(tmp_path / "moved")
    assert recording_digest(moved) == before
    (moved / "a.db3").write_bytes(b"rowS")
    assert recording_digest(moved) != before


def test_a_missing_recording_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read"):
        recording_digest(tmp_path / "none.bag")
