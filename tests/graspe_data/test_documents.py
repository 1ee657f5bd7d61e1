"""The same content gives the same bytes, and what is read is checked."""

from __future__ import annotations

from pathlib import Path

import pytest

from graspe_data.documents import canonical_json, file_digest, parse_document, parse_mapping
from graspe_data.errors import ZooError
from graspe_data.manifest import Settings

WHERE = Path("some/file.json")


class Size(Settings):
    rows: int


def test_the_order_of_keys_does_not_matter() -> None:
    assert canonical_json({"b": 1.5, "a": []}) == canonical_json({"a": [], "b": 1.5})
    assert canonical_json({"b": 1, "a": None}, indent=None) == '{"a":null,"b":1}'
    with pytest.raises(ValueError, match="JSON"):
        canonical_json({"a": float("nan")})


def test_the_digest_of_a_file_is_its_sha256(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"abc")
    known = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert file_digest(tmp_path / "a") == known


def test_a_document_becomes_its_model() -> None:
    assert parse_document(b'{"rows": 3}', Size, WHERE, ZooError, "") == Size(rows=3)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"{", "not valid JSON"),
        (b"[" * 100_000, "not valid JSON"),
        (b"\xff", "not valid JSON"),
        (b"[]", "expected a mapping, found list"),
        (b'{"rows": 1, "rows": 2}', "the key 'rows' stands twice"),
        (b'{"row": 1}', "row: unknown key. Did you mean 'rows'"),
    ],
)
def test_a_document_that_is_none_is_refused_by_name(content: bytes, fault: str) -> None:
    with pytest.raises(ZooError, match=rf"(?s)some/file\.json.*{fault}.*Mend it\."):
        parse_document(content, Size, WHERE, ZooError, "Mend it.")


def test_a_mapping_may_hold_anything() -> None:
    assert parse_mapping(b'{"x": [1]}', WHERE, ZooError, "") == {"x": [1]}
