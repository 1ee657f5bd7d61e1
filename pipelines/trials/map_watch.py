"""The maps that a planner drove by: how long they took, and how right they were."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.field import Field
from graspe_data.simulation.message_stream import START_NS
from graspe_data.simulation.motion.drive import STEP_S, Drive
from graspe_data.simulation.truth.cell_counts import CellCounts, count_cells
from graspe_data.simulation.truth.true_cells import true_cells
from pipelines.trials.map_methods import MapScoreSettings
from pipelines.trials.map_score import MapScore
from planners.cost_map import CostMap, MapSource
from planners.situation import Situation

Pose = tuple[float, float, float]


class MapWatch:
    """A ``MapSource`` that hands on the maps of another, times them, and keeps some."""

    def __init__(self, source: MapSource, settings: MapScoreSettings) -> None:
        """Take the source that is watched."""
        self._source, self._settings = source, settings
        self._stamp_ns = 0
        self._took_s: list[float] = []
        self._maps: list[tuple[int, NDArray[np.bool_], float]] = []

    def cost_map(self, situation: Situation) -> CostMap:
        """See ``MapSource``."""
        begun = time.perf_counter()
        made = self._source.cost_map(situation)
        took = time.perf_counter() - begun
        # The second question about a cloud is answered from memory, and tells nothing.
        if made.stamp_ns != self._stamp_ns:
            self._stamp_ns = made.stamp_ns
            self._took_s.append(took)
            self._keep(made)
        return made

    def score(self, field: Field, drive: Drive) -> MapScore | None:
        """Compare the maps that were kept with the world; None where there is none.

        Args:
            field: The world, and where the lidar is.
            drive: The true poses.
        """
        if not self._took_s:
            return None
        counts = CellCounts()
        for stamp_ns, solid, cell_m in self._maps:
            counts += self._counts(field, _true_pose(drive, stamp_ns), solid, cell_m)
        return MapScore(
            maps=len(self._maps),
            called=counts.called,
            right=counts.right,
            there=counts.there,
            found=counts.found,
            precision=counts.precision,
            recall=counts.recall,
            f_score=counts.f_score,
            median_ms=1e3 * float(np.median(self._took_s)),
        )

    def _keep(self, made: CostMap) -> None:
        last_ns = self._maps[-1][0] if self._maps else None
        if last_ns is None or made.stamp_ns - last_ns >= self._settings.every_s * 1e9 - 1:
            self._maps.append((made.stamp_ns, made.solid, made.cell_m))

    def _counts(
        self, field: Field, pose: Pose, solid: NDArray[np.bool_], cell_m: float
    ) -> CellCounts:
        x, y = field.lidar.base_from_lidar.translation[:2].tolist()
        truth = true_cells(field.world, pose, (x, y), len(solid), cell_m)
        return count_cells(solid, truth, cell_m, self._settings)


def _true_pose(drive: Drive, stamp_ns: int) -> Pose:
    """Where the robot really was; x, y, yaw in the world."""
    since_s = (stamp_ns - START_NS) * 1e-9
    row = int(np.clip(round(since_s / STEP_S), 0, len(drive.time_s) - 1))
    x, y = drive.position[row, :2].tolist()
    return x, y, float(drive.attitude[row, 2])
