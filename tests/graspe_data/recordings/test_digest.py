from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings import recording_digest


def test_a_file_has_the_digest_of_its_content(tmp_path: Path) -> None:
    (tmp_path / "a.bag").write_bytes(b"bag")
    assert recording_digest(tmp_path / "a.bag") == hashlib.sha256(b"bag").hexdigest()


def test_a_folder_with_one_file_is_that_file_whatever_lies_beside_it(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"first")
    (tmp_path / "notes.txt").write_text("mine")
    assert recording_digest(tmp_path) == hashlib.sha256(b"first").hexdigest()


def test_several_files_have_the_digest_of_their_digests_in_order(tmp_path: Path) -> None:
    for number, content in ((1, b"second"), (0, b"first")):
        (tmp_path / f"a_{number}.mcap").write_bytes(content)
    lines = "".join(f"{hashlib.sha256(part).hexdigest()}\n" for part in (b"first", b"second"))
    assert recording_digest(tmp_path) == hashlib.sha256(lines.encode()).hexdigest()
    assert recording_digest(tmp_path / "a_1.mcap") == recording_digest(tmp_path)


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
    with pytest.raises(RecordingError, match="no such file or folder"):
        recording_digest(tmp_path / "none.bag")
