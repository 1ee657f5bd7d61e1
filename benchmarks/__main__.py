"""Every benchmark in one run: a Markdown table and a JSON file."""

from __future__ import annotations

import argparse
import os
import platform
import sys
from pathlib import Path

from benchmarks import (
    bench_agnn,
    bench_intensity_map,
    bench_loading,
    bench_pipeline,
    bench_planning,
    bench_simulation,
    bench_smoothness,
    bench_training,
)
from benchmarks.measurement import Measurement, render_json, render_table

BENCHMARKS = (
    bench_smoothness,
    bench_intensity_map,
    bench_simulation,
    bench_pipeline,
    bench_loading,
    bench_agnn,
    bench_training,
    bench_planning,
)


def main() -> int:
    """Run, print and store; exit code 1 where a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--quick", action="store_true", help="shorter, for a first look")
    arguments = parser.parse_args()
    measured: list[Measurement] = []
    for benchmark in BENCHMARKS:
        sys.stderr.write(f"{benchmark.__name__} ...\n")
        measured += benchmark.run(arguments.quick)
    machine = f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    table = f"{machine}; ratios are within one run.\n\n{render_table(measured)}"
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "results.md").write_text(table)
    (arguments.out / "results.json").write_text(render_json(measured))
    print(table)
    return int(any(measurement.met is False for measurement in measured))


if __name__ == "__main__":
    sys.exit(main())
