"""A sealed folder is read only where every file is what its seal says."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from graspe_data.errors import ZooError
from graspe_data.sealed_folder import SEAL_FILE, SealedFolder

KIND = SealedFolder("parcel", "parcel-1", frozenset({"a", "b"}), ZooError, "Send it again.")
CONTENTS = {"a": b"one", "b": b"two, three"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    KIND.write(tmp_path / "parcel", CONTENTS)
    return tmp_path / "parcel"


def test_what_was_written_is_read_and_named(folder: Path) -> None:
    assert KIND.read(folder, ("b",)) == {"b": b"two, three"}
    digest = hashlib.sha256((folder / SEAL_FILE).read_bytes()).hexdigest()
    assert KIND.check(folder) == digest


def test_the_seal_has_the_bytes_that_it_always_had(folder: Path) -> None:
    """Seals written before must be the same: the digest of the seal names a checkpoint."""
    a, b = (hashlib.sha256(content).hexdigest() for content in CONTENTS.values())
    text = (
        '{\n  "files": {\n    "a": {\n      "bytes": 3,\n      "sha256": "%s"\n    },\n'
        '    "b": {\n      "bytes": 10,\n      "sha256": "%s"\n    }\n  },\n'
        '  "format": "parcel-1"\n}\n'
    )
    assert (folder / SEAL_FILE).read_text() == text % (a, b)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"oNe", "a: was changed or damaged: SHA-256"),
        (b"on", "a: has 2 bytes, the seal says 3. Send it again"),
        (None, "a: missing, so .*parcel is no finished parcel"),
    ],
)
def test_a_damaged_file_is_named_whether_it_is_read_or_not(
    folder: Path, content: bytes | None, fault: str
) -> None:
    (folder / "a").unlink()
    if content is not None:
        (folder / "a").write_bytes(content)
    with pytest.raises(ZooError, match=fault):
        KIND.check(folder)
    for names in ("a", "b"):
        with pytest.raises(ZooError, match=fault):
            KIND.read(folder, names)


def test_a_file_that_claims_to_be_huge_is_not_read(folder: Path) -> None:
    seal = json.loads((folder / SEAL_FILE).read_text())
    seal["files"]["a"]["bytes"] = 1 << 40
    (folder / SEAL_FILE).write_text(json.dumps(seal))
    with pytest.raises(ZooError, match="a: sealed as 1099511627776 bytes"):
        KIND.read(folder, ("a",))


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"format": "parcel-2"}, "format 'parcel-2', expected 'parcel-1'"),
        ({"files": {}}, "lists other files than a parcel has: a, b"),
        ({"more": 1}, "more: unknown key"),
    ],
)
def test_another_seal_is_refused(folder: Path, change: dict[str, object], fault: str) -> None:
    seal = json.loads((folder / SEAL_FILE).read_text()) | change
    (folder / SEAL_FILE).write_text(json.dumps(seal))
    with pytest.raises(ZooError, match=fault):
        KIND.check(folder)


def test_a_folder_half_written_over_has_no_seal(folder: Path) -> None:
    with pytest.raises(TypeError):
        KIND.write(folder, {"a": b"new", "b": 3})  # type: ignore[dict-item]
    with pytest.raises(ZooError, match="no finished parcel"):
        KIND.check(folder)
