"""``dataset.json``: what a dataset holds, where it came from, and the digest that names it."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import Field, JsonValue, StringConstraints, field_validator, model_validator

from graspe_data.atomic_file import write_atomically
from graspe_data.calibration import RecordedCalibration
from graspe_data.columns import Column
from graspe_data.documents import Sha256, canonical_json, parse_document
from graspe_data.errors import ShardError
from graspe_data.links import check_link
from graspe_data.manifest import Settings, validate

INDEX_FILE = "dataset.json"

_LARGEST_INDEX = 256 << 20
_NUMBERS = {"bool", "float16", "float32", "float64"} | {
    f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)
}

Count = Annotated[int, Field(ge=0, le=1 << 48)]
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_-]{0,99}$")]


class ShardFile(Settings):
    """A shard as ``dataset.json`` commits it: ``columns`` has the SHA-256 of every member."""

    path: str
    rows: Count
    bytes: Count
    columns: dict[str, Sha256]

    @field_validator("path")
    @classmethod
    def _stays_in_the_folder(cls, path: str) -> str:
        parts = PurePosixPath(path).parts
        if not parts or path != "/".join(parts) or {"..", "/"} & set(parts) or "\\" in path:
            raise ValueError("expected a relative path within the dataset's folder")
        if "\0" in path:
            raise ValueError("a path cannot hold a zero byte")
        return path


class RecordingEntry(Settings):
    """A recording that the dataset was made from, and what became of it.

    Attributes:
        name: Its file or folder name; it may move, so this is not part of the dataset's digest.
        digest: SHA-256 of its contents; empty where it could not be read.
        group: The value of the group key (a day, a place, a world) by which it was split.
        split: The split its rows went to; None where it gave no rows.
        rows: Rows in the dataset.
        losses: Anchors that made no row, counted under their reason.
        columns: SHA-256 of every column of its episode.
        stages: Key of every stage that made the episode.
        details: The rest. ``camera``, ``base_from_camera`` and ``base_from_lidar`` are read as
            :attr:`calibration`, ``findings`` as :attr:`findings`. ``content`` is the digest of
            what the messages say, by which a test recording is known again in training data;
            ``world`` the scenario and seed of a simulated one;
            ``time_zero_ns`` the stamp from which label intervals count. The others are for
            people: ``overlaps``, ``files``, ``offsets_ns``, ``shifts_ns``, ``damage``,
            ``annotated``, ``events``, ``not_judged``, ``statistics``; of a recording that gave
            nothing ``refused``, and ``counted_as`` where another one counts for it. Of a recording
            that is split by blocks of time each split has an entry of its own, with ``blocks_ns``.
    """

    name: str
    digest: Sha256 | Literal[""]
    group: str
    split: Name | None = None
    rows: Count = 0
    losses: Mapping[str, Count] = {}
    columns: Mapping[str, Sha256] = {}
    stages: Mapping[str, str] = {}
    details: Mapping[str, JsonValue] = {}

    @property
    def calibration(self) -> RecordedCalibration:
        """What the recording told of its sensors; None in it where the dataset does not keep it.

        Raises:
            ManifestError: ``details`` keeps no calibration there.
        """
        kept = {name: self.details.get(name) for name in RecordedCalibration.model_fields}
        return validate(kept, RecordedCalibration, f"{self.name}: calibration in {INDEX_FILE}")

    @property
    def blocks_ns(self) -> list[tuple[int, int]]:
        """From when to when the blocks of time of its split last; none of a whole recording."""
        kept = self.details.get("blocks_ns")
        spans = kept if isinstance(kept, list) else []
        ends = [[n for n in span if isinstance(n, int)] for span in spans if isinstance(span, list)]
        return [(span[0], span[1]) for span in ends if len(span) == 2]  # noqa: PLR2004

    def is_apart_from(self, other: RecordingEntry) -> bool:
        """Whether rows of both may be in different splits: they are of other blocks of time."""
        mine, theirs = self.blocks_ns, other.blocks_ns
        if self.split == other.split or not mine or not theirs:
            return self.split == other.split
        return all(start >= stop or end <= begin for start, end in mine for begin, stop in theirs)

    @property
    def findings(self) -> list[tuple[str, str]]:
        """Course and text of each agreement and disagreement of its sources; none in old ones."""
        findings = self.details.get("findings")
        return [
            (str(finding.get("course", "")), str(finding.get("text", "")))
            for finding in (findings if isinstance(findings, list) else [])
            if isinstance(finding, dict)
        ]


class DatasetIndex(Settings):
    """The content of ``dataset.json``.

    Attributes:
        columns: The columns, declared.
        group_key: What rows were grouped by for the split.
        splits: For each split its shards, in the order of their rows.
        recordings: In the order that the column ``recording`` refers to.
        losses: Anchors that made no row, over all recordings, counted under their reason.
        configuration: The resolved configuration, without what concerns storage alone.
        storage: Configuration that changes the layout but not the rows, such as rows a shard.
        order_seed: Seed of the order in which rows were shuffled into shards.
        statistics: Numbers for the report.
        dataset_digest: :meth:`content_digest`; set by :func:`write_index`.
        document_digest: :meth:`whole_digest`; set by :func:`write_index`.
    """

    format: Literal["graspe-dataset-1"] = "graspe-dataset-1"
    name: str
    columns: tuple[Column, ...]
    group_key: str
    splits: dict[Name, list[ShardFile]]
    recordings: list[RecordingEntry]
    losses: Mapping[str, Count] = {}
    configuration: Mapping[str, JsonValue] = {}
    storage: Mapping[str, JsonValue] = {}
    order_seed: int = 0
    statistics: Mapping[str, JsonValue] = {}
    dataset_digest: Sha256 | Literal[""] = ""
    document_digest: Sha256 | Literal[""] = ""

    @field_validator("columns")
    @classmethod
    def _are_arrays_of_numbers(cls, columns: tuple[Column, ...]) -> tuple[Column, ...]:
        for column in columns:
            if column.dtype not in _NUMBERS:
                raise ValueError(f"column {column.name!r} has dtype {column.dtype!r}, not a number")
            if any(size < 0 for size in column.shape):
                raise ValueError(f"column {column.name!r} has a negative size in its shape")
        names = [column.name for column in columns]
        if len(set(names)) != len(names):
            raise ValueError("two columns have the same name")
        return columns

    @model_validator(mode="after")
    def _recordings_are_on_one_side(self) -> DatasetIndex:
        sides: dict[str, list[RecordingEntry]] = {}
        for entry in self.recordings:
            if not entry.digest or entry.split is None:
                continue
            others = sides.setdefault(entry.digest, [])
            if other := next((known for known in others if not entry.is_apart_from(known)), None):
                raise ValueError(
                    f"the recording {entry.name} is in the splits {other.split!r} and "
                    f"{entry.split!r}"
                )
            others.append(entry)
        return self

    @model_validator(mode="after")
    def _rows_add_up(self) -> DatasetIndex:
        made: Counter[str | None] = Counter()
        for entry in self.recordings:
            made[entry.split] += entry.rows
        for split in {*self.splits, *made}:
            stored = sum(shard.rows for shard in self.splits.get(split or "", []))
            if stored != made[split]:
                raise ValueError(
                    f"split {split!r} has {stored} rows in its shards, {made[split]} by its "
                    "recordings"
                )
        return self

    def rows(self, split: str) -> int:
        """Rows of a split."""
        return sum(shard.rows for shard in self.shards(split))

    def shards(self, split: str) -> list[ShardFile]:
        """Shards of a split.

        Raises:
            ShardError: No such split; the text lists those there are.
        """
        if split not in self.splits:
            known = ", ".join(sorted(self.splits)) or "none"
            raise ShardError(f"{self.name}: no split {split!r}; the dataset has {known}.")
        return self.splits[split]

    def content_digest(self) -> str:
        """SHA-256 over what decides the rows and their order, whatever the shards' layout.

        That is the columns, the recordings' and their episodes' digests, groups and splits, the
        configuration without storage, and the seed of the order. Names and paths are left out.
        """
        recordings = [
            entry.model_dump(include={"digest", "group", "split", "rows", "columns"})
            for entry in self.recordings
        ]
        content = self.model_dump(
            mode="json", include={"format", "group_key", "configuration", "order_seed"}
        )
        columns = [column.model_dump(mode="json", exclude={"codec"}) for column in self.columns]
        return _digest({**content, "columns": columns, "recordings": recordings})

    def whole_digest(self) -> str:
        """SHA-256 over all of the document but this digest: nothing of it can change unseen."""
        return _digest(self.model_dump(mode="json", exclude={"document_digest"}))


def write_index(folder: Path, index: DatasetIndex) -> DatasetIndex:
    """Write ``dataset.json`` atomically, with its digest; the step that commits a dataset.

    Returns:
        The index with ``dataset_digest`` set.

    Raises:
        ShardError: It cannot be written, or holds numbers that JSON does not have.
    """
    named = index.model_copy(update={"dataset_digest": index.content_digest()})
    committed = named.model_copy(update={"document_digest": named.whole_digest()})
    text = _text(committed.model_dump(mode="json")) + "\n"
    write_atomically(folder / INDEX_FILE, [text.encode("utf-8")], ShardError)
    return committed


def read_index(folder: Path) -> DatasetIndex:
    """Read and validate the ``dataset.json`` of a folder.

    Raises:
        ShardError: It is missing, a link that is not followed, not JSON, not valid (each fault with
            its key), or was edited so that its digest no longer fits.
    """
    path = folder / INDEX_FILE
    check_link(path, folder, ShardError)
    try:
        if path.stat().st_size > _LARGEST_INDEX:
            raise ShardError(
                f"{path}: larger than {_LARGEST_INDEX} bytes, so no index of a dataset."
            )
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise ShardError(
            f"{path}: missing, so {folder} is no finished dataset. Give the folder that "
            "`graspe dataset build` wrote, or run it again to finish."
        ) from error
    except OSError as error:
        raise ShardError(f"{path}: cannot be read: {error.strerror}.") from error
    index = parse_document(content, DatasetIndex, path, ShardError, _REBUILD)
    _check_digests(path, index)
    return index


_REBUILD = "Build the dataset again."


def _check_digests(path: Path, index: DatasetIndex) -> None:
    digests = (
        (index.content_digest(), index.dataset_digest),
        (index.whole_digest(), index.document_digest),
    )
    for expected, found in digests:
        if expected != found:
            raise ShardError(
                f"{path}: was changed by hand or damaged: its content has the digest {expected}, "
                f"it says {found or 'none'}. {_REBUILD}"
            )


def _digest(content: Mapping[str, Any]) -> str:
    text = _text(content, indent=None)
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def _text(content: Mapping[str, Any], indent: int | None = 2) -> str:
    try:
        return canonical_json(content, indent=indent)
    except ValueError as error:
        raise ShardError(f"{INDEX_FILE}: {error}; store null where there is no number.") from error
