"""All settings of trials and of the planners in them."""

from __future__ import annotations

import hashlib
import json

from graspe_data.manifest import Settings
from graspe_data.robot import Robot
from graspe_data.simulation.scenario import Scenario
from pipelines.trials.map_methods import MapSettings
from pipelines.trials.settings import TrialSettings
from planners.dwa_fox import FoxSettings
from planners.dwa_lab import LabSettings
from planners.graspe_planner import GraspePlannerSettings


class TrialConfig(Settings):
    """A file that `graspe navigate run --config` reads."""

    trial: TrialSettings = TrialSettings()
    """How trials are run."""
    dwa_fox: FoxSettings = FoxSettings()
    """Of the method ``dwa_fox``."""
    dwa_lab: LabSettings = LabSettings()
    """Of the method ``dwa_lab``."""
    maps: MapSettings = MapSettings()
    """Of the methods that drive by a map."""
    graspe: GraspePlannerSettings = GraspePlannerSettings()
    """Of all methods with a bundle."""


class Conditions(Settings):
    """What the trials of one scenario share, whatever the method and the seed."""

    scenario: Scenario
    robot: Robot
    trial: TrialSettings
    condition: str = ""
    """The name of the condition of the sensors; empty where they are the scenario's."""

    @property
    def label(self) -> str:
        """What tables and folders call the scenario: its name, and its condition's if any."""
        return f"{self.scenario.name}+{self.condition}" if self.condition else self.scenario.name

    @property
    def digest(self) -> str:
        """SHA-256 of all settings, defaults included, but for the condition's name."""
        return digest_of(self.model_dump(mode="json", exclude={"condition"}))


def digest_of(content: object) -> str:
    """SHA-256 of what JSON can hold, whatever the order of its keys."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
