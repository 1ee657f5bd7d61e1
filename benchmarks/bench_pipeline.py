"""Recording to shards against the bare floor; two workers against one; memory against length."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rosbags.highlevel import AnyReader

from benchmarks.long_recording import LoopedDrive
from benchmarks.measurement import Measurement, render_table
from graspe_data.progress import Silent
from graspe_data.shards.dataset_index import read_index
from pipelines.build import build_dataset
from pipelines.dataset_settings import DatasetRecipe, SplitSettings, load_recipe
from pipelines.executors import Workers, one_thread

PAIRS = 7
"""The machine's pace changes within seconds: each build is held against the floor beside it."""
FORMATS = {7: "f4", 4: "u2"}
ROW_BYTES = 443_000


def bench_recipe() -> DatasetRecipe:
    """The paper's dataset with all rows in one split."""
    recipe = load_recipe("graspe")
    split = SplitSettings(train=1, validation=0, test=0)
    return recipe.model_copy(update={"dataset": recipe.dataset.model_copy(update={"split": split})})


def floor(recording: Path, target: Path, row_bytes: int) -> int:
    """Read, deserialise, decode, resize, cloud to array, write as many bytes a picture.

    The least that any converter does with the same libraries in one thread: no synchronisation,
    no reliability, no digests, nothing checked.
    """
    rows = 0
    with AnyReader([recording]) as reader, target.open("wb") as file:
        for connection, _, data in reader.messages():
            message: Any = reader.deserialize(data, connection.msgtype)
            if connection.msgtype.endswith("CompressedImage"):
                picture = cv2.imdecode(message.data, cv2.IMREAD_COLOR_RGB)
                assert picture is not None
                small = cv2.resize(picture, (320, 240), interpolation=cv2.INTER_AREA)
                file.write(small.data)
                file.write(bytes(max(0, row_bytes - small.nbytes)))
                rows += 1
            elif connection.msgtype.endswith("PointCloud2"):
                _cloud(message)
        file.flush()
        os.fsync(file.fileno())
    return rows


def _cloud(message: Any) -> np.ndarray[Any, np.dtype[np.float32]]:
    layout = np.dtype(
        {
            "names": [field.name for field in message.fields],
            "formats": [FORMATS[field.datatype] for field in message.fields],
            "offsets": [field.offset for field in message.fields],
            "itemsize": message.point_step,
        }
    )
    points = np.frombuffer(message.data, layout)
    return np.stack([points[name] for name in ("x", "y", "z", "intensity")], axis=1)


def hash_promised(recording: Path, target: Path) -> None:
    """SHA-256 of what a build gives digests of, and the floor does not.

    The recording once; the bytes that the floor wrote twice, as episode and as shards.
    """
    for path in (recording, target, target):
        with path.open("rb") as file:
            hashlib.file_digest(file, "sha256")


def timed(work: Callable[[], object]) -> float:
    """Seconds that some work takes."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def build(recordings: list[Path], out: Path, processes: int) -> int:
    """Build a dataset and return its rows."""
    result = build_dataset(bench_recipe(), recordings, out, Workers(processes), Silent())
    return result.index.rows("train")


def peak_memory_mb() -> float:
    """The most memory that this process held; unlike ru_maxrss, nothing of its parent's."""
    status = Path("/proc/self/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) * 1024 / 1e6


def bench_against_floor(folder: Path, looped: LoopedDrive, seconds: int) -> list[Measurement]:
    """All stages against the floor, in turns."""
    recording = folder / "one.bag"
    looped.write(recording, "bag", seconds)
    rows = build([recording], folder / "warm", 1)
    index = read_index(folder / "warm")
    row_bytes = sum(shard.bytes for shard in index.shards("train")) // rows
    pictures = floor(recording, folder / "floor", row_bytes)
    pairs = []
    for number in range(PAIRS):
        bare = timed(lambda: floor(recording, folder / "floor", row_bytes)) / pictures
        hashing = timed(lambda: hash_promised(recording, folder / "floor")) / pictures
        out = folder / f"out{number}"
        ours = timed(lambda out=out: build([recording], out, 1)) / rows  # type: ignore[misc]
        pairs.append((ours, bare, hashing))
        shutil.rmtree(out)
    ours, bare, hashing = sorted(pairs, key=lambda pair: pair[0] / pair[1])[PAIRS // 2]
    note = (
        f"{seconds} s, 640x480 JPEG, VLP-16 28,800 points, 10 Hz, {row_bytes / 1000:.0f} kB a row, "
        f"{recording.stat().st_size / 1e6:.0f} MB; the median pair of {PAIRS}"
    )
    return [
        Measurement(
            name="recording to shards, all stages",
            value=ours * 1000,
            unit="ms/row",
            peer="floor: read, decode, write",
            peer_value=bare * 1000,
            target=2.5,
            better="lower",
            note=note,
        ),
        Measurement(
            name="recording to shards, digests in the floor",
            value=ours * 1000,
            unit="ms/row",
            peer="floor, and SHA-256 of recording, episode and shards",
            peer_value=(bare + hashing) * 1000,
            better="lower",
            note=f"of the floor's time the digests take {hashing * 1000:.2f} ms a picture",
        ),
        Measurement(
            name="recording to shards",
            value=ours * rows / (recording.stat().st_size / 1e9),
            unit="s/GB",
            note="one process",
        ),
    ]


def bench_workers(folder: Path, looped: LoopedDrive, seconds: int) -> list[Measurement]:
    """Two local processes against one, over eight recordings; the same of the floor alone."""
    recordings = [folder / f"part{number}.bag" for number in range(8)]
    for number, recording in enumerate(recordings):
        looped.write(recording, "bag", seconds, start_s=1000 * number)
    note = f"8 recordings of {seconds} s; whole commands, start of the processes included"
    return [
        _scaling("two workers against one", "build", recordings, folder, 1.8, note),
        _scaling(
            "two floors at once against one",
            "floor",
            recordings,
            folder,
            None,
            f"{note}; what the machine allows",
        ),
    ]


def _scaling(
    name: str,
    work: str,
    recordings: list[Path],
    folder: Path,
    target: float | None,
    note: str,
) -> Measurement:
    """How much sooner two processes are done than one: the median of three pairs."""
    pairs = []
    for repeat in range(3):
        seconds = []
        for processes in (1, 2):
            out = folder / f"{work}{processes}-{repeat}"
            command = [sys.executable, "-m", "benchmarks.bench_pipeline", work, str(processes)]
            run = [*command, str(out), *map(str, recordings)]
            seconds.append(timed(lambda run=run: subprocess.run(run, check=True)))  # type: ignore[misc]
            shutil.rmtree(out)
        pairs.append(seconds)
    one, two = sorted(pairs, key=lambda pair: pair[0] / pair[1])[1]
    return Measurement(
        name=name,
        value=1 / two,
        unit="runs/s",
        peer="one worker",
        peer_value=1 / one,
        target=target,
        note=note,
    )


def bench_memory(folder: Path, looped: LoopedDrive, seconds: int) -> Measurement:
    """Peak memory of a build in a process of its own, for a recording and one ten times longer."""
    peaks = []
    for length in (seconds, 10 * seconds):
        recording = folder / f"long{length}.bag"
        looped.write(recording, "bag", length)
        command = [sys.executable, "-m", "benchmarks.bench_pipeline", "build", "1"]
        run = [*command, str(folder / f"memory{length}"), str(recording)]
        answer = subprocess.run(run, check=True, capture_output=True, text=True)
        peaks.append(json.loads(answer.stdout)["peak_mb"])
        recording.unlink()
    return Measurement(
        name="peak memory, recording ten times longer",
        value=peaks[1],
        unit="MB",
        peer=f"{seconds} s",
        peer_value=peaks[0],
        target=1.1,
        better="lower",
        note=f"{10 * seconds} s against {seconds} s, one process",
    )


def run(quick: bool) -> list[Measurement]:
    """All measurements of the pipeline."""
    one_thread()
    looped = LoopedDrive()
    seconds = 20 if quick else 120
    with tempfile.TemporaryDirectory(prefix="graspe-bench-") as name:
        folder = Path(name)
        measured = bench_against_floor(folder, looped, seconds)
        measured += bench_workers(folder, looped, seconds // 2)
        measured.append(bench_memory(folder, looped, 40))
    return measured


def floors(recordings: list[Path], out: Path, processes: int) -> None:
    """The floor of each recording, in some processes."""
    out.mkdir()
    targets = [out / recording.name for recording in recordings]
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        list(pool.map(floor, recordings, targets, [ROW_BYTES] * len(recordings)))


def main() -> None:
    """Run one command of the comparison of workers, or the benchmark."""
    if sys.argv[1:2] == ["build"]:
        one_thread()
        rows = build([Path(path) for path in sys.argv[4:]], Path(sys.argv[3]), int(sys.argv[2]))
        print(json.dumps({"rows": rows, "peak_mb": peak_memory_mb()}))
    elif sys.argv[1:2] == ["floor"]:
        floors([Path(path) for path in sys.argv[4:]], Path(sys.argv[3]), int(sys.argv[2]))
    else:
        print(render_table(run("--quick" in sys.argv)))


if __name__ == "__main__":
    main()
