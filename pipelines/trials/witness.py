"""What a model that is never wrong would answer: the world's own word on every arc."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.calibration import Calibration
from graspe_data.simulation.field import Field
from graspe_data.simulation.truth.outlook import arc_success
from pipelines.trials.trial import Pose
from planners.bundle import Bundle
from planners.scorer import Scene, Scorer


class Witness:
    """Sees where the robot really is, and knows how arcs from there end."""

    def __init__(self, field: Field) -> None:
        """Take the field that the robot drives in."""
        self._field = field
        self._pose: Pose = field.world.start

    def see(self, pose: Pose) -> None:
        """Take the true pose: x, y in metres and yaw in rad, world frame."""
        self._pose = pose

    def success(self, velocities: Floats, steps: int, step_s: float) -> NDArray[np.float32]:
        """1 where arcs of velocities (K, 2) get through, else 0, float32 (K, steps)."""
        field = self._field
        poses = np.tile(np.array(self._pose), (len(velocities), 1))
        mechanics = field.scenario.motion.mechanics
        through = arc_success(
            field.world, field.robot, poses, velocities, steps, step_s, settings=mechanics
        )
        return through.astype(np.float32)


class TruthfulScorer(Scorer):
    """A bundle's scorer that sees as the bundle does, and judges as the world does."""

    def __init__(self, bundle: Bundle, calibration: Calibration, witness: Witness) -> None:
        """Take the bundle, the robot's calibration, and who knows."""
        super().__init__(bundle, calibration)
        self._witness = witness

    def judge(self, scene: Scene, velocities: Floats) -> NDArray[np.float32]:
        """See ``Scorer``; the scene is not asked."""
        del scene
        observed = self.contract.observation
        steps, step_s = observed.horizon_steps, observed.horizon_step_s
        return self._witness.success(velocities, steps, step_s)
