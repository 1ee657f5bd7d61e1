"""What a task finds where it runs: memory that was faulted in once, and few objects to collect."""

import gc
import subprocess
import sys

from pipelines.executors import Workers, run_all

ARRAYS = """
import resource
import numpy as np
from pipelines.executors import Workers, run_all

def faults(times):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(times):
        [np.ones(100_000) for _ in range(4)]
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

print(next(run_all(Workers(), faults, [100]))[1])
"""


def test_arrays_use_memory_that_earlier_ones_left() -> None:
    command = [sys.executable, "-c", ARRAYS]
    told = subprocess.run(command, check=True, capture_output=True, text=True)
    assert int(told.stdout) < 8000, "four arrays of 800 kB have 784 pages"


def test_what_stands_before_a_task_is_collected_after_it() -> None:
    [(_, frozen)] = run_all(Workers(), lambda _: gc.get_freeze_count(), [None])
    assert frozen is not None
    assert frozen > 1000
    assert gc.get_freeze_count() == 0
