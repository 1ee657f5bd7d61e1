"""Load rows of 350 kB in random permutation: mapped shards, WebDataset, LitData, bare memcpy."""

from __future__ import annotations

import io
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.measurement import Measurement, render_table
from graspe_data.columns import Column
from graspe_data.shards import Dataset, EpochOrder
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, write_index
from graspe_data.shards.shard_writer import write_shard

ROWS = 2048
QUICK_ROWS = 384
ROWS_PER_SHARD = 128
BATCH = 32
SHAPES: dict[str, tuple[str, tuple[int, ...]]] = {
    "image": ("uint8", (240, 320, 3)),
    "points": ("float32", (10000, 3)),
    "velocity_history": ("float32", (50, 2)),
    "success": ("uint8", (10,)),
}

Row = dict[str, NDArray[np.generic]]
Epoch = Callable[[int], int]
Samples = Callable[[int], Iterator[Row]]


def make_rows(count: int) -> Row:
    """All rows at once; incompressible, so that no codec has an easier time."""
    draw = np.random.default_rng(0)
    return {
        name: draw.integers(0, 256, (count, *shape), dtype=np.uint8)
        if dtype == "uint8"
        else draw.random((count, *shape), dtype=np.float32)
        for name, (dtype, shape) in SHAPES.items()
    }


def write_shards(folder: Path, rows: Row) -> Dataset:
    columns = tuple(
        Column(name=name, dtype=dtype, shape=shape, unit="", frame="", meaning="", stage="bench")
        for name, (dtype, shape) in SHAPES.items()
    )
    count = len(rows["image"])
    shards = [
        write_shard(
            folder,
            f"train/{begin:06d}.npz",
            columns,
            {name: array[begin : begin + ROWS_PER_SHARD] for name, array in rows.items()},
        )
        for begin in range(0, count, ROWS_PER_SHARD)
    ]
    recording = RecordingEntry(name="made", digest="0" * 64, group="", split="train", rows=count)
    index = DatasetIndex(
        name="bench",
        columns=columns,
        group_key="none",
        splits={"train": shards},
        recordings=[recording],
    )
    write_index(folder, index)
    return Dataset(folder, "train")


def shards_by_batch(dataset: Dataset) -> Epoch:
    order = EpochOrder(len(dataset), dataset.digest, batch_size=BATCH)

    def epoch(number: int) -> int:
        steps = order.epoch_steps(number * len(dataset))
        return sum(len(dataset.batch(step.indices)["image"]) for step in steps)

    return epoch


def shards_by_row(dataset: Dataset) -> Epoch:
    order = EpochOrder(len(dataset), dataset.digest)

    def epoch(number: int) -> int:
        steps = order.epoch_steps(number * len(dataset))
        return sum(len(dataset.row(int(step.indices[0]))) // len(SHAPES) for step in steps)

    return epoch


def bare_copies(rows: Row) -> Epoch:
    """The floor: each row copied once, from memory to memory, into arrays that are used again."""
    count = len(rows["image"])
    packed = np.concatenate(
        [array.reshape(count, -1).view(np.uint8) for array in rows.values()], axis=1
    )
    batch = np.empty((BATCH, packed.shape[1]), np.uint8)

    def epoch(number: int) -> int:
        order = np.random.default_rng(number).permutation(count).tolist()
        for place, row in enumerate(order):
            batch[place % BATCH] = packed[row]
        return count

    return epoch


def web_dataset(folder: Path, rows: Row) -> Samples:
    """Tar files of ``.npy`` members, and a shuffle buffer that holds the whole set."""
    import webdataset  # noqa: PLC0415

    folder.mkdir()
    count = len(rows["image"])
    urls = []
    for begin in range(0, count, ROWS_PER_SHARD):
        urls.append(str(folder / f"{begin:06d}.tar"))
        with webdataset.TarWriter(urls[-1]) as writer:
            for index in range(begin, min(count, begin + ROWS_PER_SHARD)):
                members = {f"{name}.npy": _npy(array[index]) for name, array in rows.items()}
                writer.write({"__key__": f"{index:08d}", **members})

    def samples(number: int) -> Iterator[Row]:
        stored = webdataset.WebDataset(urls, shardshuffle=False, seed=number)
        for sample in stored.shuffle(count, initial=count).decode():
            yield {name: sample[f"{name}.npy"] for name in SHAPES}

    return samples


def lit_data(folder: Path, rows: Row) -> Samples:
    """Chunks of raw numpy arrays; StreamingDataset permutes the chunks and the rows within each."""
    os.environ["LITDATA_DISABLE_VERSION_CHECK"] = "1"
    from litdata import StreamingDataset  # noqa: PLC0415
    from litdata.streaming.writer import BinaryWriter  # noqa: PLC0415

    folder.mkdir()
    writer = BinaryWriter(str(folder), chunk_bytes=64 << 20)
    for index in range(len(rows["image"])):
        writer[index] = {name: array[index] for name, array in rows.items()}
    writer.done()
    writer.merge()

    def samples(number: int) -> Iterator[Row]:
        yield from StreamingDataset(str(folder), shuffle=True, seed=number)

    return samples


def by_row(samples: Samples) -> Epoch:
    return lambda number: sum("image" in row for row in samples(number))


def by_batch(samples: Samples) -> Epoch:
    """Rows of a peer stacked to batches, as a loader's default collation does."""

    def epoch(number: int) -> int:
        stream, loaded = samples(number), 0
        while part := list(islice(stream, BATCH)):
            batch = {name: np.stack([row[name] for row in part]) for name in SHAPES}
            loaded += len(batch["image"])
        return loaded

    return epoch


def best_rates(epochs: Mapping[str, Epoch], rows: int, repeats: int) -> dict[str, float]:
    """Rows a second, the best of some epochs after one to warm the page cache.

    All take turns, so that whatever else the machine does falls on each alike.
    """
    best = dict.fromkeys(epochs, 0.0)
    for number in range(repeats + 1):
        for name, epoch in epochs.items():
            begin = time.perf_counter()
            assert epoch(number) == rows, f"{name}: an epoch did not give every row"
            rate = rows / (time.perf_counter() - begin)
            best[name] = max(best[name], rate) if number else 0.0
    return best


def run(quick: bool) -> list[Measurement]:
    """Measure; ``quick`` takes fewer rows."""
    count, repeats = (QUICK_ROWS, 2) if quick else (ROWS, 4)
    rows = make_rows(count)
    with tempfile.TemporaryDirectory() as folder:
        dataset = write_shards(Path(folder, "shards"), rows)
        web, lit = web_dataset(Path(folder, "web"), rows), lit_data(Path(folder, "lit"), rows)
        epochs = {
            "memcpy": bare_copies(rows),
            "batches": shards_by_batch(dataset),
            "rows": shards_by_row(dataset),
            "batches WebDataset": by_batch(web),
            "rows WebDataset": by_row(web),
            "batches LitData": by_batch(lit),
            "rows LitData": by_row(lit),
        }
        rates = best_rates(epochs, count, repeats)
    size = sum(array.nbytes for array in rows.values()) // count
    note = f"{count} rows of {size // 1000} kB, permuted, one process, warm page cache"

    def measured(kind: str, peer: str, peer_rate: float, target: float | None) -> Measurement:
        name = f"load {kind}"
        return Measurement(name, rates[kind], "rows/s", peer, peer_rate, target, note=note)

    return [
        measured(kind, peer, rates[f"{kind} {peer}"], 10.0)
        for kind in ("batches", "rows")
        for peer in ("WebDataset", "LitData")
    ] + [
        measured(kind, "memcpy of each row", rates["memcpy"], None) for kind in ("batches", "rows")
    ]


def _npy(array: NDArray[np.generic]) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return stream.getvalue()


if __name__ == "__main__":
    print(render_table(run(quick="--quick" in sys.argv)))
