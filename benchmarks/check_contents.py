"""What it costs to compare a dataset with its digests before a training."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.bench_loading import (
    ROWS,
    Epoch,
    best_rates,
    make_rows,
    shards_by_batch,
    write_shards,
)
from benchmarks.publish import publish
from graspe_data.shards import Dataset
from graspe_data.shards.dataset import Check

REPEATS = 3
OUT = Path(__file__).parent / "results" / "check_contents.md"


def checked(dataset: Dataset, check: Check) -> Epoch:
    """All contents compared once, as a training does before it begins."""

    def epoch(number: int) -> int:  # noqa: ARG001 - every time alike
        *_, rows = Dataset(dataset.path, dataset.split, check=check).check_shards()
        return rows

    return epoch


def main() -> None:
    """Measure, print and store."""
    with tempfile.TemporaryDirectory() as folder:
        dataset = write_shards(Path(folder, "shards"), make_rows(ROWS))
        kinds: dict[str, Epoch] = {
            "SHA-256, as `dataset.json` has it": checked(dataset, "sha256"),
            "CRC-32, as the shard itself has it": checked(dataset, "crc"),
            "an epoch of batches, not checked": shards_by_batch(dataset),
        }
        rates = best_rates(kinds, ROWS, REPEATS)
    lines = [
        f"`python -m benchmarks.check_contents`: {ROWS} rows of 350 kB, warm page cache.",
        "",
        "| what | rows/s | seconds for 100,000 rows |",
        "| --- | --- | --- |",
        *(f"| {name} | {rate:,.0f} | {1e5 / rate:.0f} |" for name, rate in rates.items()),
    ]
    publish(lines, OUT)


if __name__ == "__main__":
    main()
