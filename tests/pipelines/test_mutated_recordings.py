"""Damaged recordings: each ends in rows or in a named reason; no traceback, hang or blow-up."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from graspe_data.recordings.writing import COMPRESSIONS, Container, RecordingWriter
from graspe_data.simulation import recording
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.recorded_truth import truth_path
from graspe_data.simulation.recording import record_drive
from graspe_data.simulation.simulated_drive import SimulatedDrive
from pipelines.dataset_settings import DatasetRecipe
from pipelines.process_recording import Episode, RecordingTask, process_recording
from tests.conftest import GardenDrive
from tests.pipelines.recorded_variants import write_variants

CONTAINERS: tuple[Container, ...] = ("bag", "db3", "mcap")
SAMPLE, SOAK = 50, 667
PEAK_MIB = 600
CHUNK = 1 << 15
SAMPLED = ("points", "intensity", "smoothness", "r_edge", "r_planar", "r_point")
ROOT = Path(__file__).resolve().parents[2]
OUT_OF_MEMORY = re.compile(r"MemoryError|[Cc]annot allocate|[Uu]nable to allocate|out of memory")


class SmallChunks(RecordingWriter):
    """Writes chunks of 32 KiB, so that damage seldom takes all of a small recording."""

    def write(self, topic: str, message: object, bag_time_ns: int) -> None:
        super().write(topic, message, bag_time_ns)
        if self.container == "bag":
            self._writer.chunk_threshold = CHUNK
        elif self.container == "mcap" and self._writer.storage.chunk.bio.tell() > CHUNK:
            self._writer.storage.close_chunk()


@dataclass
class Case:
    """What became of one damaged recording."""

    number: int
    name: str
    damages: Sequence[str]
    outcome: str = "died"
    reasons: list[str] = field(default_factory=list)
    peak_mib: float = 0.0

    @property
    def fault(self) -> str:
        """What is wrong with how it ended, if anything."""
        if self.outcome in ("died", "traceback"):
            return self.outcome
        if self.outcome != "rows" and not any(self.reasons):
            return "no reason"
        if self.peak_mib > PEAK_MIB or OUT_OF_MEMORY.search(" ".join(self.reasons)):
            return "memory"
        return "Traceback" if any("Traceback" in reason for reason in self.reasons) else ""


@pytest.fixture
def sound(
    container: Container,
    garden_drive: GardenDrive,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Path:
    """A folder of small recordings, one a compression."""
    monkeypatch.setattr(recording, "RecordingWriter", SmallChunks)
    driven = garden_drive(
        (Leg(3.5, 0.6, 0.1),),
        camera={"width": 64, "height": 48},
        lidar={"maximum_range": 3.5},
        rates={"odometry": 20.0, "imu": 20.0},
    )
    _write_sound_recordings(tmp_path / "sound", container, driven)
    return tmp_path / "sound"


@pytest.mark.parametrize("container", CONTAINERS)
def test_every_sound_one_gives_the_same_rows(
    container: Container, recipe: DatasetRecipe, sound: Path, tmp_path: Path
) -> None:
    found = {}
    for path in sorted(sound.iterdir()):
        result = process_recording(RecordingTask(path, recipe, tmp_path / path.name))
        assert isinstance(result, Episode), result
        assert not result.extracted.losses, path.name
        found[path.name] = _rows(tmp_path / path.name)
    first = next(iter(found.values()))
    assert first
    for name, columns in found.items():
        assert {column for column in first if columns[column] != first[column]} == set(), name


def _rows(episodes: Path) -> dict[str, bytes]:
    """The columns of an episode by their file, but for those that sample by its digest."""
    files = [path for path in sorted(episodes.rglob("*.npy")) if path.stem not in SAMPLED]
    return {path.name: path.read_bytes() for path in files}


@pytest.mark.parametrize("container", CONTAINERS)
def test_every_damaged_recording_ends_in_rows_or_a_reason(
    container: Container, recipe: DatasetRecipe, sound: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with capsys.disabled():
        _check(container, recipe, sound, range(SAMPLE))


@pytest.mark.soak
@pytest.mark.parametrize("container", CONTAINERS)
def test_every_one_of_thousands_ends_in_rows_or_a_reason(
    container: Container, recipe: DatasetRecipe, sound: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with capsys.disabled():
        _check(container, recipe, sound, range(SAMPLE, SAMPLE + SOAK))


def _check(container: Container, recipe: DatasetRecipe, sound: Path, numbers: range) -> None:
    folder = sound.parent
    (folder / "recipe.json").write_text(recipe.model_dump_json())
    cases = list(_run(folder, numbers))
    counts = Counter(case.outcome for case in cases)
    sys.stderr.write(f"\n{container}: {len(cases)} damaged recordings: {dict(counts)}\n")
    faults = [case for case in cases if case.fault]
    assert not faults, "\n".join(f"{case.fault}: {case}" for case in faults[:20])
    assert len(cases) == len(numbers)
    assert counts["rows"] > len(cases) / 10
    assert counts["refused"] > 0


def _write_sound_recordings(folder: Path, container: Container, driven: SimulatedDrive) -> None:
    folder.mkdir()
    for compression in COMPRESSIONS[container]:
        path = folder / f"{compression}{'.bag' if container == 'bag' else ''}"
        record_drive(driven, path, container, compression)
        truth_path(path).unlink()
    write_variants(folder, container)


def _run(folder: Path, numbers: range) -> Iterator[Case]:
    """Run the cases in child processes: where one dies, another goes on after it."""
    left = list(numbers)
    while left:
        done = _run_child(folder, left)
        yield from done
        left = left[len(done) :]


def _run_child(folder: Path, numbers: list[int]) -> list[Case]:
    scratch = folder / f"scratch_{numbers[0]}"
    scratch.mkdir()
    child = subprocess.run(
        [
            *(sys.executable, "-m", "tests.pipelines.process_damaged"),
            *(folder / "sound", folder / "recipe.json", scratch, json.dumps(numbers)),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    cases: list[Case] = []
    for line in child.stdout.splitlines():
        report = json.loads(line)
        if "name" in report:
            cases.append(Case(report["case"], report["name"], report["damages"]))
        else:
            cases[-1].outcome, cases[-1].reasons = report["outcome"], report["reasons"]
            cases[-1].peak_mib = report.get("peak_mib", 0.0)
    assert cases, child.stderr
    if cases[-1].outcome == "died":
        cases[-1].reasons = [f"exit code {child.returncode}: {child.stderr[-2000:]}"]
    return cases
