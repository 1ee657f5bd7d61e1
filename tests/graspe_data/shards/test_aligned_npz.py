from __future__ import annotations

import hashlib
import io
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from graspe_data.errors import ShardError
from graspe_data.shards.aligned_npz import NpzMap, map_npz, write_npz

Arrays = dict[str, NDArray[np.generic]]

DTYPES = ["?", "u1", "i1", "<u2", ">i2", "<i4", "<u8", ">f4", "<f2", "<f4", "<f8"]
NAMES = st.from_regex(r"[a-z_][a-z0-9_.]{0,80}", fullmatch=True)
ARRAYS = st.dictionaries(
    NAMES,
    st.sampled_from(DTYPES).flatmap(
        lambda dtype: hnp.arrays(dtype, hnp.array_shapes(min_dims=0, max_dims=4, min_side=0))
    ),
    min_size=1,
    max_size=6,
)
IN_ONE_FOLDER = settings(
    max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)


def identical(found: NDArray[np.generic], expected: NDArray[np.generic]) -> bool:
    return (
        found.dtype == expected.dtype
        and found.shape == expected.shape
        and found.tobytes() == expected.tobytes()
    )


@IN_ONE_FOLDER
@given(arrays=ARRAYS, zip64=st.sampled_from([None, True]))
def test_arrays_come_back_from_numpy_and_from_the_map(
    tmp_path: Path, arrays: Arrays, zip64: bool | None
) -> None:
    path = tmp_path / "arrays.npz"
    write_npz(path, arrays, zip64=zip64)
    mapped = map_npz(path)
    assert mapped.keys() == arrays.keys()
    assert all(identical(mapped[name], array) for name, array in arrays.items())
    with np.load(path, allow_pickle=False) as loaded:
        assert all(identical(loaded[name], array) for name, array in arrays.items())


@IN_ONE_FOLDER
@given(arrays=ARRAYS, zip64=st.sampled_from([None, True]))
def test_data_is_aligned_and_read_only(tmp_path: Path, arrays: Arrays, zip64: bool | None) -> None:
    path = tmp_path / "arrays.npz"
    write_npz(path, arrays, zip64=zip64)
    for array in map_npz(path).values():
        assert array.size == 0 or array.ctypes.data % 64 == 0
        assert not array.flags.writeable


@IN_ONE_FOLDER
@given(arrays=ARRAYS)
def test_digests_are_those_of_the_members(tmp_path: Path, arrays: Arrays) -> None:
    path = tmp_path / "arrays.npz"
    digests = write_npz(path, arrays)
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        for name, digest in digests.items():
            assert hashlib.sha256(archive.read(f"{name}.npy")).hexdigest() == digest
            assert NpzMap(path).digest(name) == digest
            assert NpzMap(path).crc_matches(name)


def test_any_order_of_the_same_arrays_gives_the_same_bytes(tmp_path: Path) -> None:
    arrays: Arrays = {"b": np.arange(6.0).reshape(2, 3), "a": np.array([True, False])}
    write_npz(tmp_path / "one.npz", arrays)
    write_npz(tmp_path / "two.npz", {"a": arrays["a"], "b": np.asfortranarray(arrays["b"])})
    content = (tmp_path / "one.npz").read_bytes()
    assert content == (tmp_path / "two.npz").read_bytes()
    golden = "365f4f1831c9b3be5e90ec11fc3b50d20e771128d4dd8911a7fa424ed9f37e35"
    assert hashlib.sha256(content).hexdigest() == golden


@pytest.mark.skipif(shutil.which("unzip") is None, reason="unzip is not installed")
def test_unzip_accepts_the_file(tmp_path: Path) -> None:
    for zip64 in (False, True):
        path = tmp_path / f"{zip64}.npz"
        write_npz(path, {"a": np.arange(100), "b": np.zeros(3)}, zip64=zip64)
        subprocess.run(["unzip", "-tqq", path], check=True)


def test_files_of_numpy_are_mapped_too(tmp_path: Path) -> None:
    arrays: Arrays = {"a": np.asfortranarray(np.arange(6).reshape(2, 3)), "b": np.ones(())}
    np.savez(tmp_path / "plain.npz", **arrays)  # type: ignore[arg-type]
    mapped = map_npz(tmp_path / "plain.npz")
    assert all(np.array_equal(mapped[name], array) for name, array in arrays.items())


def test_maps_outlive_the_replacement_of_their_file(tmp_path: Path) -> None:
    path = tmp_path / "arrays.npz"
    write_npz(path, {"a": np.arange(1000)})
    mapped = map_npz(path)["a"]
    write_npz(path, {"a": np.zeros(3)})
    assert np.array_equal(mapped, np.arange(1000))


def test_only_named_arrays_are_mapped(tmp_path: Path) -> None:
    write_npz(tmp_path / "a.npz", {"a": np.zeros(3), "b": np.zeros(3)})
    assert map_npz(tmp_path / "a.npz", ["b"]).keys() == {"b"}
    with pytest.raises(ShardError, match=r"a\.npz: no array 'c'; it has a, b"):
        map_npz(tmp_path / "a.npz", ["c"])


def test_nothing_partial_stays_after_a_failure(tmp_path: Path) -> None:
    path = tmp_path / "folder.npz"
    path.mkdir()
    with pytest.raises(ShardError, match="cannot be written: Is a directory"):
        write_npz(path, {"a": np.zeros(3)})
    with pytest.raises(ShardError, match="cannot be written: No such file"):
        write_npz(tmp_path / "nowhere" / "a.npz", {"a": np.zeros(3)})
    assert [file.name for file in tmp_path.iterdir()] == ["folder.npz"]


@pytest.mark.parametrize(
    "array", [np.array([None]), np.array(["text"]), np.zeros(2, "c16"), np.zeros(2, "i4,f4")]
)
def test_anything_but_numbers_is_refused(tmp_path: Path, array: NDArray[np.generic]) -> None:
    with pytest.raises(ShardError, match=r"a\.npz: bad: dtype"):
        write_npz(tmp_path / "a.npz", {"bad": array})


@pytest.mark.parametrize("name", ["", "../up", "/root", "a/b", "ä", ".hidden", "a\\b"])
def test_names_that_are_no_names_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ShardError, match="cannot name an array"):
        write_npz(tmp_path / "a.npz", {name: np.zeros(1)})


def test_pickled_arrays_are_never_loaded(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", a=np.array([print], dtype=object))
    with pytest.raises(ShardError, match=r"a\.npz: a: not an array: .* plain array of numbers"):
        map_npz(tmp_path / "a.npz")


def test_compressed_members_are_refused(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "a.npz", a=np.zeros(100))
    with pytest.raises(ShardError, match=r"a\.npz: not a shard: member 'a.npy' is compressed"):
        map_npz(tmp_path / "a.npz")


@pytest.mark.parametrize("content", [b"", b"PK", b"PK\5\6", b"\0" * 1000, b"PK\5\6" + b"\xff" * 18])
def test_what_is_no_zip_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(ShardError, match=r"a\.npz: not a shard"):
        map_npz(tmp_path / "a.npz")


def hostile(header: str) -> bytes:
    """A zip file with one stored member of that ``.npy`` header and 16 bytes of data."""
    text = header.ljust(117).encode() + b"\n"
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(
            "a.npy", b"\x93NUMPY\1\0" + len(text).to_bytes(2, "little") + text + bytes(16)
        )
    return stream.getvalue()


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f4', 'fortran_order': False, 'shape': (999999999999999999, 4), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 999999999999999999, 99), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-4,), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2 2,), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (5,), }",
        "{'descr': '|O8', 'fortran_order': False, 'shape': (2,), }",
        "{'descr': '<f9', 'fortran_order': False, 'shape': (2,), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (__import__('os'),), }",
        "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[",
    ],
)
def test_hostile_array_headers_are_refused(tmp_path: Path, header: str) -> None:
    (tmp_path / "a.npz").write_bytes(hostile(header))
    with pytest.raises(ShardError, match=r"a\.npz: a: not an array"):
        map_npz(tmp_path / "a.npz")


def test_members_of_the_same_name_are_refused(tmp_path: Path) -> None:
    write_npz(tmp_path / "a.npz", {"a": np.zeros(1), "b": np.zeros(1)})
    content = (tmp_path / "a.npz").read_bytes()
    (tmp_path / "a.npz").write_bytes(content.replace(b"b.npy", b"a.npy"))
    with pytest.raises(ShardError, match="two members have the same name"):
        map_npz(tmp_path / "a.npz")


@settings(IN_ONE_FOLDER, max_examples=300)
@given(data=st.data(), zip64=st.booleans())
def test_mutations_end_in_arrays_or_in_one_error(
    tmp_path: Path, data: st.DataObject, zip64: bool
) -> None:
    path = tmp_path / "arrays.npz"
    write_npz(path, {"a": np.arange(20), "b": np.zeros((2, 3), np.uint8)}, zip64=zip64)
    content = bytearray(path.read_bytes())
    for position in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=8)):
        content[position] = data.draw(st.sampled_from([0, 1, 0x7F, 0xFF, content[position] ^ 1]))
    cut = data.draw(st.sampled_from([0, 0, 0, 1, 22, 100]))
    path.write_bytes(content[: len(content) - cut])
    try:
        mapped = map_npz(path)
    except ShardError as error:
        mapped = {}
        named = str(error)
    else:
        named = "arrays.npz"
    assert "arrays.npz" in named
    assert sum(len(array.tobytes()) for array in mapped.values()) <= len(content)
