"""KISS-ICP's parts, which are an extra, set up so that the same clouds give the same bytes.

It adds up in parallel by oneTBB. One thread alone is not enough: oneTBB asks once, at its first
sum, how many processors the process may use, and cuts its sums into pieces after that number, so
that last digits differ between machines and under taskset. Its first sum is therefore made here,
while the process may use one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from graspe_data.errors import RecordingError

FIRST_DEVIATION_M = 2.0
"""How far the first motion may be from none, as KISS-ICP has it."""


@dataclass(frozen=True)
class KissIcp:
    """The parts of KISS-ICP, which is an extra."""

    config: Any
    registration: Any
    mapping: Any
    threshold: Any
    thin: Any

    @classmethod
    def load(cls) -> KissIcp:
        """Import the parts.

        Raises:
            RecordingError: KISS-ICP is not installed.
        """
        try:
            from kiss_icp import config, mapping, registration, threshold, voxelization  # noqa: PLC0415
        except ModuleNotFoundError as error:
            if error.name is None or error.name.partition(".")[0] != "kiss_icp":
                raise
            raise RecordingError(
                "Odometry from the lidar (`odometry: lidar`) is made by KISS-ICP, which is not "
                "installed: pip install 'graspe[lidar_odometry]'."
            ) from error
        parts = cls(config.config, registration, mapping, threshold, voxelization.voxel_down_sample)
        _start_on_one_processor(parts)
        return parts

    def parts(self, voxel_size: float, maximum_range: float) -> tuple[Any, Any, Any]:
        """Registration, map and threshold; numbers are given here, none by the environment."""
        registration = self.registration.Registration(
            max_num_iterations=500, convergence_criterion=1e-4, max_num_threads=1
        )
        local_map = self.mapping.VoxelHashMap(voxel_size, maximum_range, max_points_per_voxel=20)
        settings = _ThresholdSettings(
            self.config.DataConfig(max_range=maximum_range),
            self.config.AdaptiveThresholdConfig(initial_threshold=FIRST_DEVIATION_M),
        )
        return registration, local_map, self.threshold.AdaptiveThreshold(settings)


@dataclass(frozen=True)
class _ThresholdSettings:
    data: Any
    adaptive_threshold: Any


@cache
def _start_on_one_processor(parts: KissIcp) -> None:
    corners = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    registration, local_map, _ = parts.parts(1.0, 100.0)
    local_map.update(corners, np.eye(4))
    with _one_processor():
        registration.align_points_to_map(corners, local_map, np.eye(4), 1.0, 1.0)


@contextmanager
def _one_processor() -> Iterator[None]:
    """Where the system has no such setting, the rounding of poses alone must do."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    process = os.getpid()  # oneTBB asks for the process, whichever thread it runs in
    before = os.sched_getaffinity(process)
    os.sched_setaffinity(process, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(process, before)
