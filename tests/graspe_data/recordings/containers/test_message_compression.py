"""MCAP with rosbag2's message compression: each payload is a zstd frame of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from graspe_data.recordings import Recording, open_recording


def _recompressed(folder: Path, name: str, compression: Any, broken: int | None = None) -> Path:
    """The recording with compressed payloads; one of them damaged."""
    source = next(folder.glob("*.mcap"))
    target = folder.with_name(name)
    target.mkdir()
    pack = zstandard.ZstdCompressor().compress
    with source.open("rb") as read, (target / f"{name}_0.mcap").open("wb") as write:
        writer = Writer(write, chunk_size=4000, compression=compression)
        writer.start(profile="ros2")
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for number, (schema, channel, message) in enumerate(make_reader(read).iter_messages()):
            assert schema is not None
            if channel.id not in channels:
                schemas[schema.id] = writer.register_schema(
                    schema.name, schema.encoding, schema.data
                )
                channels[channel.id] = writer.register_channel(
                    channel.topic, "cdr", schemas[schema.id]
                )
            data = pack(message.data)
            if number == broken:
                data = data[:-9]
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time)
        writer.finish()  # type: ignore[no-untyped-call]
    return target


def _describe(folder: Path, target: Path, **changes: Any) -> None:
    metadata = yaml.safe_load((folder / "metadata.yaml").read_text())
    metadata["rosbag2_bagfile_information"].update(
        compression_format="zstd",
        compression_mode="MESSAGE",
        relative_file_paths=[file.name for file in target.glob("*.mcap*")],
        **changes,
    )
    (target / "metadata.yaml").write_text(yaml.safe_dump(metadata))


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("described", [True, False])
def test_payloads_are_decompressed_with_and_without_metadata(
    write: Any, read: Any, compression: Any, described: bool
) -> None:
    folder = write("mcap")
    target = _recompressed(folder, "packed", compression)
    if described:
        _describe(folder, target)
    assert read(target) == read(folder)
    with open_recording(target) as recording:
        assert recording.losses == []
        raws = list(recording.messages())
        assert recording.header_stamp_ns(raws[0]) == raws[0].bag_time_ns - 5
        words: Any = recording.decode(raws[1])
        assert words.data == "number 0"


@pytest.mark.parametrize("described", [True, False])
def test_a_damaged_payload_costs_one_message(write: Any, read: Any, described: bool) -> None:
    folder = write("mcap")
    target = _recompressed(folder, "packed", CompressionType.NONE, broken=42)
    if described:
        _describe(folder, target)
    whole = read(folder)
    assert read(target) == whole[:42] + whole[43:]
    with open_recording(target) as recording:
        list(recording.messages())
        (loss,) = recording.losses
        assert (loss.topic, loss.messages) == (whole[42][0], 1)
        assert "zstd payload" in loss.reason


def test_a_file_compressed_as_a_whole_may_hold_compressed_messages(write: Any, read: Any) -> None:
    folder = write("mcap")
    target = _recompressed(folder, "packed", CompressionType.LZ4)
    file = next(target.glob("*.mcap"))
    packed = file.with_name(f"{file.name}.zstd")
    packed.write_bytes(zstandard.compress(file.read_bytes()))
    file.unlink()
    _describe(folder, target)
    assert read(target) == read(folder)


def test_metadata_that_speaks_of_compression_does_not_spoil_plain_payloads(
    write: Any, read: Any
) -> None:
    folder = write("mcap")
    whole = read(folder)
    _describe(folder, folder)
    assert read(folder) == whole


def test_a_cut_file_gives_the_beginning_decompressed(write: Any, read: Any) -> None:
    folder = write("mcap")
    target = _recompressed(folder, "packed", CompressionType.ZSTD)
    file = next(target.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    found, whole = read(target), read(folder)
    assert found == whole[: len(found)]
    assert len(found) > 30


def test_another_compression_of_messages_is_named(write: Any) -> None:
    folder = write("mcap")
    target = _recompressed(folder, "packed", CompressionType.NONE)
    _describe(folder, target)
    text = (target / "metadata.yaml").read_text().replace("zstd", "brotli")
    (target / "metadata.yaml").write_text(text)
    with open_recording(target) as recording:
        assert "'brotli'" in recording.losses[0].reason


def test_a_payload_that_expands_without_end_is_refused_by_its_declared_size(
    tmp_path: Path,
) -> None:
    bomb = zstandard.compress(bytes(1 << 29))
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start(profile="ros2")
        channel = writer.register_channel("/x", "cdr", writer.register_schema("a/B", "", b""))
        writer.add_message(channel, 1, bomb, 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with open_recording(tmp_path / "a.mcap") as recording:
        assert list(recording.messages()) == []
        assert _lost(recording) == 1


def _lost(recording: Recording) -> int:
    return sum(loss.messages or 0 for loss in recording.losses)
