"""The settings of a robot's motion."""

from __future__ import annotations

from graspe_data.manifest import Settings
from graspe_data.simulation.motion.gait import GaitSettings
from graspe_data.simulation.motion.mechanics import MechanicsSettings, SlipSettings
from graspe_data.simulation.motion.wheel_odometry import OdometrySettings


class MotionSettings(Settings):
    """How a robot moves, and what its own sensors make of it."""

    mechanics: MechanicsSettings = MechanicsSettings()
    slip: SlipSettings = SlipSettings()
    gait: GaitSettings = GaitSettings()
    odometry: OdometrySettings = OdometrySettings()
