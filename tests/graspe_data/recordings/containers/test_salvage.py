from __future__ import annotations

import random
import resource
import zlib
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from graspe_data.errors import RecordingError
from graspe_data.recordings import RecordingWriter, open_recording
from graspe_data.recordings.containers.decompression import decompress
from graspe_data.recordings.message_types import message_classes

MUTATIONS = 200
VARIANTS = [
    ("bag", "none"),
    ("bag", "bz2"),
    ("bag", "lz4"),
    ("mcap", "none"),
    ("mcap", "lz4"),
    ("mcap", "zstd"),
]
CHECKED = [("bag", "bz2"), ("mcap", "zstd")]


@pytest.mark.parametrize(("container", "compression"), VARIANTS)
@pytest.mark.parametrize("share", [0.4, 0.7, 0.95])
def test_a_cut_file_gives_the_beginning_of_the_whole_one(
    write: Any, read: Any, single: Any, container: Any, compression: Any, share: float
) -> None:
    path = single(write(container, compression))
    whole = read(path)
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    found = read(path)
    assert found == whole[: len(found)]
    assert len(found) >= (share - 0.25) * len(whole)
    with open_recording(path) as recording:
        assert recording.losses


def test_a_cut_in_the_middle_of_a_chunk_gives_its_whole_messages(
    write: Any, read: Any, single: Any
) -> None:
    path = single(write("bag", "none", chunk_bytes=1 << 20))
    whole = read(path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert len(read(path)) > len(whole) // 3


@pytest.mark.parametrize("suffix", [".bag", ".bag.active"])
def test_a_bag_that_a_crash_left_without_index(tmp_path: Path, read: Any, suffix: str) -> None:
    text: Any = message_classes()["std_msgs/msg/String"]

    def crash() -> None:
        with RecordingWriter(tmp_path / f"a{suffix}", "bag") as writer:
            inner: Any = writer._writer
            inner.chunk_threshold = 500
            for number in range(100):
                writer.write("/x", text("word " * 10), number)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        crash()
    times = [time for _, time, _ in read(tmp_path / f"a{suffix}")]
    assert times == list(range(len(times)))
    assert len(times) > 80


@pytest.mark.parametrize(("container", "compression"), CHECKED)
def test_a_broken_chunk_costs_its_messages_and_says_how_many(
    write: Any, read: Any, single: Any, container: Any, compression: Any
) -> None:
    path = single(write(container, compression))
    whole = read(path)
    content = bytearray(path.read_bytes())
    start = len(content) * 2 // 5
    content[start : start + 300] = bytes(300)
    path.write_bytes(content)
    found = read(path)
    assert set(found) < set(whole)
    assert len(found) > len(whole) * 0.6
    assert found[-1] == whole[-1]
    with open_recording(path) as recording:
        assert len(list(recording.messages())) == len(found)
        lost = Counter(dict.fromkeys(recording.topics, 0))
        for loss in recording.losses:
            lost[str(loss.topic)] += loss.messages or 0
        assert sum(lost.values()) == len(whole) - len(found)
        assert any(loss.seconds for loss in recording.losses)


def test_a_wrong_length_of_a_bag_index_record_costs_nothing(
    write: Any, read: Any, single: Any
) -> None:
    path = single(write("bag", "bz2"))
    whole = read(path)
    content = bytearray(path.read_bytes())
    place = content.index(b"op=\x04")
    count = content.index(b"count=", place - 60) + 6
    content[count : count + 4] = (77).to_bytes(4, "little")
    path.write_bytes(content)
    assert read(path) == whole


def test_an_mcap_chunk_with_a_wrong_checksum_is_left_out(
    tmp_path: Path, write: Any, read: Any
) -> None:
    from mcap.writer import CompressionType, Writer  # noqa: PLC0415

    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file, chunk_size=100, compression=CompressionType.NONE)
        writer.start()
        channel = writer.register_channel("/x", "cdr", writer.register_schema("a/B", "", b""))
        for number in range(20):
            writer.add_message(channel, number, b"word" * 20, number)
        writer.finish()  # type: ignore[no-untyped-call]
    content = bytearray((tmp_path / "a.mcap").read_bytes())
    place = content.index(b"word" * 20, len(content) // 3)
    content[place] ^= 1
    (tmp_path / "a.mcap").write_bytes(content)
    with open_recording(tmp_path / "a.mcap") as recording:
        found = list(recording.messages())
        lost = sum(loss.messages or 0 for loss in recording.losses)
        assert len(found) + lost == 20
        assert 0 < lost < 5
        assert "checksum" in recording.losses[0].reason


def test_a_chunk_that_claims_a_terabyte_is_refused_without_allocating() -> None:
    assert decompress(b"abc", "zstd", 1 << 40) == (
        b"",
        "claims 1099511627776 bytes from 3 compressed ones",
    )


@pytest.mark.parametrize("compression", ["bz2", "lz4", "zstd"])
def test_a_bomb_gives_no_more_than_declared(compression: str) -> None:
    import bz2  # noqa: PLC0415

    import lz4.frame  # noqa: PLC0415
    import zstandard  # noqa: PLC0415

    pack = {"bz2": bz2.compress, "lz4": lz4.frame.compress, "zstd": zstandard.compress}
    bomb = pack[compression](bytes(50 << 20))
    content, _ = decompress(bomb, compression, 1000)
    assert content == bytes(1000)


def _mutate(content: bytearray, chance: random.Random) -> bytes:
    kind = chance.randrange(5)
    place = chance.randrange(len(content))
    if kind == 0:
        for _ in range(chance.choice([1, 3, 20])):
            content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    elif kind == 1:
        del content[place:]
    elif kind == 2:
        size = min(chance.choice([16, 512, 4096]), len(content) // 3)
        one, other = sorted(chance.sample(range(0, len(content) - size, size), 2))
        block = content[one : one + size]
        content[one : one + size] = content[other : other + size]
        content[other : other + size] = block
    elif kind == 3:
        hostile = chance.choice([0, 1 << 20, 1 << 30, (1 << 31) - 1, (1 << 32) - 1])
        content[place : place + 4] = hostile.to_bytes(4, "little")
    else:
        del content[place : place + chance.choice([1, 7, 100, 3000])]
    return bytes(content)


def test_mutated_recordings_end_in_messages_or_in_a_named_reason(
    write: Any, single: Any, triples: Any, tmp_path: Path
) -> None:
    variants = [*VARIANTS, ("db3", "none"), ("db3", "zstd_message"), ("db3", "zstd_file")]
    sources = [
        single(write(container, packing, name=f"{container}_{packing}"))
        for container, packing in variants
    ]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for seed in range(MUTATIONS):
        source = sources[seed % len(sources)]
        chance = random.Random(zlib.crc32(f"{seed}".encode()))  # noqa: S311
        path = tmp_path / f"mutated{''.join(source.suffixes)}"
        path.write_bytes(_mutate(bytearray(source.read_bytes()), chance))
        _read_all(path, triples)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 200 << 10


def _read_all(path: Path, triples: Any) -> None:
    try:
        with open_recording(path) as recording:
            found = triples(recording)
            assert triples(recording) == found
            assert len(found) == 120 or recording.losses
            for raw in recording.messages():
                recording.header_stamp_ns(raw)
                try:
                    recording.decode(raw)
                except RecordingError as error:
                    assert raw.topic in str(error)  # noqa: PT017
    except RecordingError as error:
        assert path.name.split(".")[0] in str(error)  # noqa: PT017
