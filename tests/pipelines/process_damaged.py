"""A child process: damaged recordings through all stages, within a limit of memory and time.

Arguments: the folder of sound recordings, the recipe's JSON, a scratch folder, the case numbers.
Writes a line of JSON before and after each case, so that whoever started it knows where it died.
"""

from __future__ import annotations

import json
import resource
import shutil
import signal
import sys
import time
import traceback
from pathlib import Path

import numpy as np

from pipelines.dataset_settings import DatasetRecipe
from pipelines.executors import one_thread
from pipelines.process_recording import Episode, RecordingTask, process_recording
from tests.pipelines.mutations import damaged_copy

MEMORY = 3 << 29
SECONDS = 20


def main(sound: Path, recipe: DatasetRecipe, scratch: Path, cases: list[int]) -> None:
    """Process the cases one by one; a hang ends the process by SIGALRM."""
    one_thread()
    _limit_memory()
    recordings = sorted(sound.iterdir())
    for case in cases:
        source = recordings[case % len(recordings)]
        target = scratch / source.name
        damages = damaged_copy(source, target, np.random.default_rng(case))
        _tell(case=case, name=source.name, damages=damages)
        signal.alarm(SECONDS)
        _tell(case=case, **_outcome(RecordingTask(target, recipe, scratch / "episodes")))
        signal.alarm(0)
        for path in (target, scratch / "episodes"):
            shutil.rmtree(path, ignore_errors=True)
            path.unlink(missing_ok=True)


def _outcome(task: RecordingTask) -> dict[str, object]:
    since = time.monotonic()
    try:
        result = process_recording(task)
    except BaseException:  # noqa: BLE001
        return {"outcome": "traceback", "reasons": [traceback.format_exc()]}
    spent = {"seconds": time.monotonic() - since, "peak_mib": _peak_mib()}
    if isinstance(result, Episode):
        record = result.extracted
        reasons = [*record.lost, *(loss.reason for loss in record.losses)]
        return {"outcome": "rows" if record.rows else "no rows", "reasons": reasons, **spent}
    return {"outcome": "refused", "reasons": [result.reason], **spent}


def _limit_memory() -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _peak_mib() -> float:
    """The most memory that this process held; ru_maxrss would begin with its parent's."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 1024


def _tell(**content: object) -> None:
    sys.stdout.write(json.dumps(content) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(
        Path(sys.argv[1]),
        DatasetRecipe.model_validate_json(Path(sys.argv[2]).read_bytes()),
        Path(sys.argv[3]),
        json.loads(sys.argv[4]),
    )
