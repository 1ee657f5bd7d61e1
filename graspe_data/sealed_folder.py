"""Folders whose files are listed with their SHA-256 in ``manifest.json``, which is written last.

Checkpoints and bundles are such folders. The seal tells damage and names a folder by its digest;
it is no signature.
"""

from __future__ import annotations

import hashlib
import stat
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from graspe_data.atomic_file import write_atomically
from graspe_data.documents import Sha256, canonical_json, parse_document
from graspe_data.errors import GraspeError
from graspe_data.links import check_link
from graspe_data.manifest import Settings

SEAL_FILE = "manifest.json"
LARGEST_SEAL = 1 << 20
LARGEST_READ = 2 << 30
"""Bytes of a file that is read into memory."""


class SealedFile(Settings):
    """Size and digest of a file."""

    bytes: Annotated[int, Field(ge=0)]
    sha256: Sha256


class Seal(Settings):
    """The content of ``manifest.json``."""

    format: str
    files: Mapping[str, SealedFile]


@dataclass(frozen=True)
class SealedFolder:
    """A kind of sealed folder: what lies in one, and how its faults are told.

    Attributes:
        name: What such a folder is, for texts.
        format: Of its layout, as the seal has it.
        files: Names of all its files but the seal.
        refusal: The error of the caller's room.
        remedy: What to do about a folder that is damaged or not finished, a sentence.
    """

    name: str
    format: str
    files: frozenset[str]
    refusal: type[GraspeError]
    remedy: str

    def write(self, folder: Path, contents: Mapping[str, bytes]) -> None:
        """Write files, then the seal; a seal that stood there is taken away first.

        Raises:
            refusal: The folder cannot be made or written.
        """
        try:
            folder.mkdir(parents=True, exist_ok=True)
            (folder / SEAL_FILE).unlink(missing_ok=True)
        except OSError as error:
            raise self.refusal(f"{folder}: cannot be made or written: {error.strerror}.") from error
        for name, content in contents.items():
            write_atomically(folder / name, [content], self.refusal)
        write_atomically(folder / SEAL_FILE, [seal_text(self.format, contents)], self.refusal)

    def check(self, folder: Path) -> str:
        """Compare every file with the seal.

        Returns:
            SHA-256 of the seal itself, which names the folder.

        Raises:
            refusal: Names the file that is missing, or of another size or content, or a link that
                is not followed.
        """
        content, seal = self._seal(folder)
        for name, entry in seal.files.items():
            self._check_file(folder / name, entry)
        return hashlib.sha256(content).hexdigest()

    def read(self, folder: Path, names: Collection[str]) -> dict[str, bytes]:
        """Some files, each read once, after all were compared with the seal.

        Raises:
            refusal: As :meth:`check`; or a file is too large to be read.
        """
        _, seal = self._seal(folder)
        kept: dict[str, bytes] = {}
        for name, entry in sorted(seal.files.items()):
            if name in names:
                kept[name] = self._read_sealed(folder / name, entry)
            else:
                self._check_file(folder / name, entry)
        return kept

    def read_bounded(self, path: Path, limit: int) -> bytes:
        """Read a file of at most ``limit`` bytes.

        Raises:
            refusal: It is missing, larger, no regular file, a link that is not followed, or cannot
                be read.
        """
        size = self._size(path)
        if size > limit:
            raise self.refusal(f"{path}: {size} bytes, expected at most {limit}. {self.remedy}")
        try:
            return path.read_bytes()
        except OSError as error:
            raise self.refusal(f"{path}: cannot be read: {error.strerror}.") from error

    def _seal(self, folder: Path) -> tuple[bytes, Seal]:
        path = folder / SEAL_FILE
        content = self.read_bounded(path, LARGEST_SEAL)
        seal = parse_document(content, Seal, path, self.refusal, self.remedy)
        if seal.format != self.format:
            raise self.refusal(
                f"{path}: format {seal.format!r}, expected {self.format!r}. {self.remedy}"
            )
        if wrong := sorted(seal.files.keys() ^ self.files):
            raise self.refusal(
                f"{path}: lists other files than a {self.name} has: {', '.join(wrong)}. "
                f"{self.remedy}"
            )
        return content, seal

    def _read_sealed(self, path: Path, entry: SealedFile) -> bytes:
        if entry.bytes > LARGEST_READ:
            raise self.refusal(
                f"{path}: sealed as {entry.bytes} bytes, expected at most {LARGEST_READ}."
            )
        self._compare_size(path, entry)
        content = self.read_bounded(path, entry.bytes)
        self._compare_digest(path, entry, hashlib.sha256(content).hexdigest())
        return content

    def _check_file(self, path: Path, entry: SealedFile) -> None:
        """Compare a file of any size, without holding it in memory."""
        self._compare_size(path, entry)
        try:
            with path.open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise self.refusal(f"{path}: cannot be read: {error.strerror}.") from error
        self._compare_digest(path, entry, digest)

    def _compare_size(self, path: Path, entry: SealedFile) -> None:
        size = self._size(path)
        if size != entry.bytes:
            raise self.refusal(
                f"{path}: has {size} bytes, the seal says {entry.bytes}. {self.remedy}"
            )

    def _compare_digest(self, path: Path, entry: SealedFile, digest: str) -> None:
        if digest != entry.sha256:
            raise self.refusal(
                f"{path}: was changed or damaged: SHA-256 {digest}, the seal says {entry.sha256}. "
                f"{self.remedy}"
            )

    def _size(self, path: Path) -> int:
        """Of a regular file, told before it is opened: to open a pipe waits for its writer."""
        check_link(path, path.parent, self.refusal)
        try:
            found = path.stat()
        except FileNotFoundError as error:
            raise self.refusal(
                f"{path}: missing, so {path.parent} is no finished {self.name}. {self.remedy}"
            ) from error
        except OSError as error:
            raise self.refusal(f"{path}: cannot be read: {error.strerror}.") from error
        if not stat.S_ISREG(found.st_mode):
            raise self.refusal(
                f"{path}: expected a regular file, found something else. {self.remedy}"
            )
        return found.st_size


def seal_text(form: str, contents: Mapping[str, bytes]) -> bytes:
    """The seal of some files.

    Args:
        form: The format that it names.
        contents: Of the files, by name.
    """
    sealed = {
        name: SealedFile(bytes=len(content), sha256=hashlib.sha256(content).hexdigest())
        for name, content in contents.items()
    }
    seal = Seal(format=form, files=sealed)
    return (canonical_json(seal.model_dump(mode="json")) + "\n").encode()
