"""Load a bundle, score trajectories, drive; numpy and onnxruntime, no torch."""

from __future__ import annotations

from typing import TYPE_CHECKING

from graspe_data.lazy_names import lazy_names

if TYPE_CHECKING:
    from graspe_data.calibration import Calibration as Calibration
    from graspe_data.sensor_data import Motion as Motion
    from graspe_data.sensor_data import Picture as Picture
    from graspe_data.sensor_data import PointCloud as PointCloud
    from planners.fitness import GuardSettings as GuardSettings
    from planners.guarded import Guarded as Guarded
    from planners.loading import load_planner as load_planner
    from planners.situation import Command as Command
    from planners.situation import Situation as Situation

_NAMES = {
    "Calibration": "graspe_data.calibration",
    "Command": "planners.situation",
    "GuardSettings": "planners.fitness",
    "Guarded": "planners.guarded",
    "Motion": "graspe_data.sensor_data",
    "Picture": "graspe_data.sensor_data",
    "PointCloud": "graspe_data.sensor_data",
    "Situation": "planners.situation",
    "load_planner": "planners.loading",
}
__all__ = [
    "Calibration",
    "Command",
    "GuardSettings",
    "Guarded",
    "Motion",
    "Picture",
    "PointCloud",
    "Situation",
    "load_planner",
]

__getattr__ = lazy_names(__name__, _NAMES)
