"""A file appears whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from graspe_data.atomic_file import PARTIAL_SUFFIX, write_atomically
from graspe_data.errors import FileError, ManifestError


def test_pieces_become_one_file(tmp_path: Path) -> None:
    assert write_atomically(tmp_path / "a", [b"one ", memoryview(b"two")]) == 7
    assert (tmp_path / "a").read_bytes() == b"one two"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_what_was_there_stays_until_the_new_file_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"before")

    def pieces() -> Iterator[bytes]:
        yield b"aft"
        (partial,) = tmp_path.glob(f".a.*{PARTIAL_SUFFIX}")
        assert path.read_bytes() == b"before"
        raise RuntimeError(partial.name)

    with pytest.raises(RuntimeError, match="partial"):
        write_atomically(path, pieces())
    assert path.read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_disk_that_refuses_is_an_error_of_the_callers_room(tmp_path: Path) -> None:
    for refusal in (FileError, ManifestError):
        with pytest.raises(refusal, match="absent/a: cannot be written: No such file"):
            write_atomically(tmp_path / "absent" / "a", [b""], refusal)
