"""A model from outside: what a user's own package holds, one file and no line elsewhere."""

from __future__ import annotations

from torch import Tensor, nn

from graspe_data.manifest import Settings
from model_zoo.bounds import Steps, Units
from model_zoo.contract import Features, Observation, SuccessModel
from model_zoo.layers.scan_input import expect_beams


class LidarGlanceSettings(Settings):
    """Attributes: ``horizon``, T; ``beams`` of a scan; ``hidden`` units."""

    horizon: Steps = 10
    beams: Units = 720
    hidden: Units = 8


class LidarGlance(SuccessModel):
    """A dense layer on the scan's nearness, one on the drawing's columns, and their sum."""

    name = "lidar_glance"
    settings_type = LidarGlanceSettings
    columns = ("laser_scan", "trajectory_image")
    candidate_columns = ("trajectory_image",)

    def __init__(self, settings: LidarGlanceSettings) -> None:
        super().__init__()
        self.horizon, self.beams = settings.horizon, settings.beams
        self.scan = nn.Sequential(nn.Linear(settings.beams, settings.hidden), nn.Tanh())
        self.drawing = nn.Sequential(nn.Linear(320, settings.hidden), nn.Tanh())
        self.last = nn.Linear(settings.hidden, settings.horizon)

    def encode(self, scene: Observation) -> Features:
        ranges = expect_beams(scene["laser_scan"], self.beams)
        return {"scan_features": self.scan(1 / (1 + ranges))}

    def score(self, features: Features, candidates: Observation) -> Tensor:
        columns = candidates["trajectory_image"].float().mean(dim=1)
        found: Tensor = self.last(features["scan_features"] + 4 * self.drawing(columns))
        return found
