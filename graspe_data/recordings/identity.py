"""The two identities of a recording: by its bytes, and by what its sensors measured."""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from struct import Struct
from typing import Any, Literal

import numpy as np

from graspe_data.documents import file_digest
from graspe_data.errors import RecordingError
from graspe_data.manifest import Settings
from graspe_data.recordings.containers.sqlite_recovery import log_beside
from graspe_data.recordings.layout import storage_files
from graspe_data.recordings.messages import RawMessage


def recording_digest(path: Path) -> str:
    """Digest the messages of a recording, whatever lies beside them.

    The log of a killed recorder holds messages, so it counts: the files of two recorders that were
    killed before they copied anything from it are the same.

    Returns:
        For one file the hexadecimal SHA-256 of its content, in a folder or not; for several, a log
        being one, the SHA-256 over one line a file with its digest, in their order.

    Raises:
        RecordingError: The path does not exist, cannot be read, or holds no recording.
    """
    try:
        digests = [_with_log(file) for file in storage_files(path)]
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}.") from error
    return digests[0] if len(digests) == 1 else _joined(digests)


def _with_log(path: Path) -> str:
    log = log_beside(path)
    return file_digest(path) if log is None else _joined([file_digest(path), file_digest(log)])


def _joined(digests: list[str]) -> str:
    return hashlib.sha256("".join(f"{digest}\n" for digest in digests).encode()).hexdigest()


Kind = Literal["image", "points", "odometry"]

CHOSEN: Mapping[Kind, int] = {"image": 4, "points": 4, "odometry": 8}
"""Of how many messages one is looked at; its stamp decides, so any cut of a drive chooses alike."""
KEPT = 2048
"""Fingerprints kept a kind: those of 13 minutes at 10 Hz, of a longer recording the smallest."""
BLOCKS = 8
BLOCK_BYTES = 512
NUMBERS = 256
TELLING_SHARE = 0.1
"""A sample that zlib makes smaller than this share is constant or nearly so: a dark picture."""
LEAST_VARYING = 32
EMPTY_PACKED = len(zlib.compress(b""))
ENCODED_HEADER = 640
"""Bytes of tables before the picture in a JPEG; those of all pictures of a camera are the same."""
SHARED = 2
"""Fingerprints of a kind that two recordings must share for that kind to say that they overlap."""
STAMP = Struct("<qq")


class ContentIdentity(Settings):
    """What a recording measured.

    Attributes:
        digest: SHA-256 over all fingerprints and message types, whatever the topics are called;
            empty where too little is known to tell recordings apart.
        begin_ns: Bag time of the first message of these topics, int64 ns.
        end_ns: Of the last one.
        fingerprints: For each kind of topic the fingerprints (64 bits) of messages that tell one
            drive from another, ascending. At most 2048, the smallest.
    """

    digest: str = ""
    begin_ns: int = 0
    end_ns: int = 0
    fingerprints: Mapping[str, tuple[int, ...]] = {}

    def overlaps(self, other: ContentIdentity) -> bool:
        """Whether some seconds of both are the same measurements.

        Two of the kinds of which both have fingerprints must agree, one of them pictures or
        clouds: a copy may have been compressed anew, and a frozen camera shows the same in two
        drives. Where one kind alone tells anything, it is enough.
        """
        both = [kind for kind in CHOSEN if self._tells(kind) and other._tells(kind)]
        agreeing = [kind for kind in both if self._shared(other, kind) >= SHARED]
        sensors = {"image", "points"} & {*agreeing}
        return bool(sensors) and len(agreeing) >= min(2, len(both))

    def _tells(self, kind: Kind) -> bool:
        return len(self.fingerprints.get(kind, ())) >= SHARED

    def _shared(self, other: ContentIdentity, kind: Kind) -> int:
        return len({*self.fingerprints.get(kind, ())} & {*other.fingerprints.get(kind, ())})


class ContentObserver:
    """Sees the messages of a pass, and looks into one of some.

    Args:
        decode: From a raw message to one with the attributes of its type, as `Recording.decode`.
        kinds: What a topic is.
        types: The message types of these topics.
    """

    def __init__(
        self,
        decode: Callable[[RawMessage], object],
        kinds: Mapping[str, Kind],
        types: Mapping[str, str],
    ) -> None:
        """Begin with nothing seen."""
        self._decode, self._kinds = decode, kinds
        self._types = sorted({f"{kind} {types.get(topic, '')}" for topic, kind in kinds.items()})
        self._all: list[bytes] = []
        self._telling: dict[Kind, list[int]] = {kind: [] for kind in CHOSEN}
        self._begin_ns: int | None = None
        self._end_ns = 0

    def watches(self, topic: str) -> bool:
        """Whether the messages of a topic are looked at."""
        return topic in self._kinds

    def observe(self, raw: RawMessage, stamp_ns: int | None) -> None:
        """Take a message; one of another topic, without stamp or damaged is passed over."""
        kind = self._kinds.get(raw.topic)
        if kind is None or stamp_ns is None:
            return
        time_ns = raw.bag_time_ns
        self._begin_ns = time_ns if self._begin_ns is None else min(self._begin_ns, time_ns)
        self._end_ns = max(self._end_ns, time_ns)
        if mix_stamp(stamp_ns) % CHOSEN[kind]:
            return
        try:
            content, length, telling = _sample(self._decode(raw), kind)
        except (RecordingError, AttributeError, TypeError, ValueError, OverflowError):
            return
        hashed = hashlib.blake2b(STAMP.pack(stamp_ns, length) + kind.encode(), digest_size=8)
        hashed.update(content)
        self._all.append(hashed.digest())
        if telling:
            self._keep(kind, int.from_bytes(hashed.digest(), "big"))

    def result(self) -> ContentIdentity:
        """The identity of what was seen."""
        known = {kind: _smallest(found) for kind, found in self._telling.items() if found}
        enough = any(len(known.get(kind, ())) >= SHARED for kind in ("image", "points"))
        whole = hashlib.sha256("\n".join(self._types).encode())
        whole.update(b"".join(sorted(self._all)))
        return ContentIdentity(
            digest=whole.hexdigest() if enough else "",
            begin_ns=self._begin_ns or 0,
            end_ns=self._end_ns,
            fingerprints=known,
        )

    def _keep(self, kind: Kind, fingerprint: int) -> None:
        found = self._telling[kind]
        found.append(fingerprint)
        if len(found) > 2 * KEPT:
            found[:] = _smallest(found)


def _smallest(found: Sequence[int]) -> tuple[int, ...]:
    return tuple(sorted(set(found))[:KEPT])


def mix_stamp(stamp_ns: int) -> int:
    """Splitmix64's finaliser: stamps of any period are chosen evenly."""
    mixed = stamp_ns & 0xFFFFFFFFFFFFFFFF
    mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9 & 0xFFFFFFFFFFFFFFFF
    mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EB & 0xFFFFFFFFFFFFFFFF
    return mixed ^ (mixed >> 31)


def _sample(message: Any, kind: Kind) -> tuple[bytes, int, bool]:
    """Some bytes of the payload, its length, and whether they tell one message from another.

    Bytes of the payload are the same in every container; the message around them is not.
    """
    if kind != "odometry" and (payload := _payload(message)) is not None:
        content = _places(payload)
        return content, payload.size, _varies(content, encoded=hasattr(message, "format"))
    numbers = [number for _, number in zip(range(NUMBERS), _numbers(message), strict=False)]
    telling = any(number not in (0.0, 1.0, -1.0) for number in numbers)
    return np.array(numbers, "<f8").tobytes(), len(numbers), telling


def _varies(content: bytes, *, encoded: bool) -> bool:
    """Whether bytes are neither constant nearly everywhere nor one short pattern."""
    varying = content[ENCODED_HEADER:] if encoded else content
    packed = len(zlib.compress(varying, 1)) - EMPTY_PACKED
    return packed > max(LEAST_VARYING, TELLING_SHARE * len(varying))


def _payload(message: Any) -> np.ndarray[Any, np.dtype[np.uint8]] | None:
    """The bytes that a picture, a cloud or packets consist of."""
    packets = getattr(message, "packets", None)
    if packets:
        chosen = [packets[len(packets) * n // BLOCKS] for n in range(BLOCKS)]
        return np.concatenate([np.asarray(packet.data, np.uint8).ravel() for packet in chosen])
    for name in ("data", "buf"):
        found = getattr(message, name, None)
        if isinstance(found, np.ndarray) and found.dtype == np.uint8:
            return found.ravel()
    return None


def _places(payload: np.ndarray[Any, np.dtype[np.uint8]]) -> bytes:
    """Blocks at places that the length alone decides, the first and the last among them."""
    if payload.size <= BLOCKS * BLOCK_BYTES:
        return payload.tobytes()
    last = payload.size - BLOCK_BYTES
    starts = [last * number // (BLOCKS - 1) for number in range(BLOCKS)]
    return b"".join(payload[start : start + BLOCK_BYTES].tobytes() for start in starts)


def _numbers(message: Any) -> Iterator[float]:
    """The numbers of a message in their order, without its header and covariances."""
    if isinstance(message, np.ndarray):
        if message.dtype.kind in "biuf":
            yield from message.ravel()[:NUMBERS].astype(np.float64).tolist()
    elif isinstance(message, (int, float)):
        yield float(message)
    elif isinstance(message, list) and message:
        for number in range(min(len(message), BLOCKS)):
            yield from _numbers(message[len(message) * number // min(len(message), BLOCKS)])
    elif is_dataclass(message):
        for field in fields(message):
            if field.name not in ("header", "covariance"):
                yield from _numbers(getattr(message, field.name))
