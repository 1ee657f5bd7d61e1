"""Pack a dataset to be sent: what its readers need, in a folder or a tar; the same bytes always."""

from __future__ import annotations

import os
import re
import tarfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from graspe_data.atomic_file import WRITE_BYTES, sync_folder, write_atomically
from graspe_data.errors import ShardError
from graspe_data.folder_lock import hold_folder
from graspe_data.links import check_link
from graspe_data.progress import Progress
from graspe_data.shards.dataset_index import INDEX_FILE, DatasetIndex, read_index
from graspe_data.shards.verify import verify_shard
from graspe_data.whole_folder import workplace

TAR = ".tar"
DOCUMENTS = ("*.labels.yaml", "labels/*.labels.yaml", "report.html", "README*", "LICENSE*")
"""What goes along beside the shards and ``dataset.json``, where it is there."""
OTHER_ARCHIVES = (".gz", ".tgz", ".bz2", ".xz", ".zst", ".zip", ".7z", ".rar")
_BLOCK, _RECORD = 512, 10_240


@dataclass(frozen=True)
class Packed:
    """What was packed.

    Attributes:
        target: The folder or the tar.
        digest: Of the dataset.
        files: Paths in the dataset's folder, in order; the index is the last one.
        bytes_before: Of all files in the dataset's folder.
        bytes_after: Of the files packed; of the tar where it is one.
        left_out: What stays behind, by its name in the dataset's folder, and its bytes.
    """

    target: Path
    digest: str
    files: tuple[str, ...]
    bytes_before: int
    bytes_after: int
    left_out: dict[str, int]


def pack_dataset(folder: Path, target: Path, progress: Progress) -> Packed:
    """Copy what readers of a dataset need; every shard is compared with its digests on the way.

    Args:
        folder: The dataset's.
        target: A file that ends in ``.tar``, or a folder. What an earlier packing left there is
            replaced; anything else stays, and is an error.
        progress: Is told of every file.

    Raises:
        ShardError: No dataset there, a shard is damaged, a build is at work in it, or the target
            holds something else, lies within the dataset or cannot be written.
    """
    read_index(folder)
    target = target.absolute()
    _check_target(folder, target)
    with hold_folder(folder, "at work", ShardError):
        index = read_index(folder)
        files = [*_checked_shards(folder, index, progress), *_documents(folder), INDEX_FILE]
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with workplace(target) as place:
                _write(folder, index, files, place / target.name)
                _put(place / target.name, place / "former", target)
        except OSError as error:
            raise ShardError(
                f"{target}: cannot be written: {error.strerror or error}. Give another --out."
            ) from error
        before = _sizes(folder)
    packed = {*files}
    after = _sizes(target) if target.is_dir() else {target.name: target.stat().st_size}
    return Packed(
        target,
        index.dataset_digest,
        tuple(files),
        sum(before.values()),
        sum(after.values()),
        _by_top({path: size for path, size in before.items() if path not in packed}),
    )


def _by_top(sizes: Mapping[str, int]) -> dict[str, int]:
    """Bytes by the first part of each path."""
    total: Counter[str] = Counter()
    for path, size in sizes.items():
        total[path.partition("/")[0]] += size
    return dict(sorted(total.items()))


def _check_target(folder: Path, target: Path) -> None:
    if target.resolve().is_relative_to(folder.resolve()):
        raise ShardError(f"{target}: lies in the dataset {folder} itself. Give another --out.")
    if target.suffix in OTHER_ARCHIVES:
        raise ShardError(
            f"{target}: expected a folder, or a file that ends in {TAR}. Compress the tar "
            f"afterwards, if you like."
        )
    if os.path.lexists(target) and not _is_packed(target):
        raise ShardError(
            f"{target}: is there already, and is no packed dataset. Give another --out, or take it "
            f"away."
        )


def _is_packed(target: Path) -> bool:
    """Whether nothing is at a place but what an earlier packing, or nobody, left there."""
    if target.is_symlink() or target.is_dir() != (target.suffix != TAR):
        return False
    return _is_packed_folder(target) if target.is_dir() else _is_packed_tar(target)


def _is_packed_folder(target: Path) -> bool:
    if not any(target.iterdir()):
        return True
    try:
        index = read_index(target)
    except ShardError:
        return False
    known = {shard.path for shards in index.splits.values() for shard in shards}
    return {*_sizes(target)} <= {*known, *_documents(target), INDEX_FILE}


def _is_packed_tar(target: Path) -> bool:
    try:
        with tarfile.open(target, "r:") as archive:
            return any(Path(name).name == INDEX_FILE for name in archive.getnames())
    except (OSError, tarfile.TarError):
        return False


def _checked_shards(folder: Path, index: DatasetIndex, progress: Progress) -> list[str]:
    """The paths of all shards, in order, each compared with its digests.

    Raises:
        ShardError: Names the first that is not as ``dataset.json`` says.
    """
    shards = [(split, shard) for split in sorted(index.splits) for shard in index.splits[split]]
    progress.start("shards", len(shards))
    for split, shard in shards:
        if faults := verify_shard(folder, index, split, shard):
            raise ShardError(
                f"{folder}: {faults[0]}. A damaged dataset is not packed: `graspe dataset verify` "
                f"lists all faults, and building again mends them."
            )
        progress.advance(f"{shard.path}: {shard.rows} rows, sound")
    return sorted({shard.path for _, shard in shards})


def _documents(folder: Path) -> list[str]:
    """Labels, report and the like that lie beside the shards, in order.

    Raises:
        ShardError: One is a link out of the folder that is not followed.
    """
    found = sorted({path for pattern in DOCUMENTS for path in folder.glob(pattern)})
    for path in found:
        check_link(path, folder, ShardError)
    return [path.relative_to(folder).as_posix() for path in found if path.is_file()]


def _sizes(folder: Path) -> dict[str, int]:
    """The bytes of every file below a folder, by its path in it."""
    return {
        path.relative_to(folder).as_posix(): path.stat().st_size
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def _write(folder: Path, index: DatasetIndex, files: Sequence[str], target: Path) -> None:
    if target.suffix == TAR:
        write_atomically(target, _tar(folder, files, _folder_name(index.name)), ShardError)
        return
    target.mkdir()
    for name in files:
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        write_atomically(target / name, _pieces(folder / name), ShardError)


def _put(made: Path, former: Path, target: Path) -> None:
    """Let what was made take the place of what an earlier packing left."""
    if target.is_dir():
        target.rename(former)
    made.rename(target)
    sync_folder(target.parent)


def _folder_name(name: str) -> str:
    """The folder in the tar: the dataset's name, of letters that every system takes."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip("._-")[:100] or "dataset"


def _tar(folder: Path, files: Sequence[str], inside: str) -> Iterator[bytes]:
    """The bytes of a tar: no times, no owners, so that the same content gives the same tar."""
    written = 0
    for name in files:
        size = (folder / name).stat().st_size
        info = tarfile.TarInfo(f"{inside}/{name}")
        info.size, info.mode = size, 0o644
        header = info.tobuf(tarfile.PAX_FORMAT)
        yield header
        read = 0
        for piece in _pieces(folder / name):
            read += len(piece)
            yield piece
        if read != size:
            raise ShardError(f"{folder / name}: changed while it was packed. Pack again.")
        padding = -size % _BLOCK
        yield bytes(padding)
        written += len(header) + size + padding
    end = 2 * _BLOCK
    yield bytes(end + -(written + end) % _RECORD)


def _pieces(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while piece := file.read(WRITE_BYTES):
            yield piece
