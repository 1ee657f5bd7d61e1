"""The methods that drive by a map: which map each makes, and with which settings."""

from __future__ import annotations

from typing import Final

from pydantic import model_validator

from graspe_data.manifest import Settings
from graspe_data.observation.intensity_map import (
    ClassSettings,
    GlassSettings,
    InflationSettings,
    LayerSettings,
    PlanningMapSettings,
)
from graspe_data.simulation.field import Field
from graspe_data.simulation.truth.cell_counts import CountSettings
from planners.cost_map import MapSource
from planners.dwa_map import MapDwaSettings
from planners.glass_peaks import PeakSettings
from planners.glass_slam_source import GlassSlamSettings, GlassSlamSource
from planners.intensity_source import IntensityMapSettings, IntensitySource
from planners.occupancy_source import OccupancySettings, OccupancySource

MIM, PRINTED, UNIFORM = "mim", "mim_printed", "mim_uniform"
OCCUPANCY, GLASS = "dwa_map", "glass_slam"
MAP_METHODS: Final = (MIM, PRINTED, UNIFORM, OCCUPANCY, GLASS)

FIELD_LAYERS: Final = LayerSettings(cell="max")
"""In this field a sum of returns tells how near grass is rather than how solid it is."""
FIELD_PLANNING: Final = PlanningMapSettings(
    classes=ClassSettings(reading="each", threshold=0.48, rim=0.3),
    glass=GlassSettings(margin=3, extend=12),
)
"""Beads hang through all layers, and reflect 0.45; stalks of grass that only one layer shows are no
glass; of a pane is seen what the lidar looks at squarely; and the rim of a bush is dim."""
FIELD_PEAKS: Final = PeakSettings(least=60.0, step=30.0)
"""Half of what the detector's authors took: a simulated pane's glint reaches 115 of 255."""


class MapScoreSettings(CountSettings):
    """How the maps of a trial are compared with the world."""

    every_s: float = 1.0
    """Seconds from a cloud whose map is compared to the next."""


class MapSettings(Settings):
    """The planner that all methods with a map share, and their maps."""

    drive: MapDwaSettings = MapDwaSettings()
    """Of all of them."""
    intensity: IntensityMapSettings = IntensityMapSettings(
        layers=FIELD_LAYERS, planning=FIELD_PLANNING
    )
    """Of ``mim``, and of ``mim_uniform`` but for the form of its inflation."""
    printed: IntensityMapSettings = IntensityMapSettings()
    """Of ``mim_printed``: equations (1) and (3) as printed, sums of intensities in a cell and of
    the layers, and nothing added to the glass that (4) to (7) find."""
    occupancy: OccupancySettings = OccupancySettings()
    """Of ``dwa_map``."""
    glass_slam: GlassSlamSettings = GlassSlamSettings(peaks=FIELD_PEAKS)
    """Of ``glass_slam``."""
    score: MapScoreSettings = MapScoreSettings()
    """How their maps are compared with the world."""

    @model_validator(mode="before")
    @classmethod
    def _over_the_field(cls, changes: object) -> object:
        """What is not given stays as the field has it, also within a block that is given."""
        if not isinstance(changes, dict):
            return changes
        defaults = {
            name: cls.model_fields[name].default for name in changes if name in cls.model_fields
        }
        return changes | {
            name: _laid_over(defaults[name].model_dump(), changes[name]) for name in defaults
        }


def _laid_over(base: object, changes: object) -> object:
    if not (isinstance(base, dict) and isinstance(changes, dict)):
        return changes
    return base | {name: _laid_over(base.get(name), value) for name, value in changes.items()}


def map_settings(name: str, settings: MapSettings) -> list[Settings]:
    """All that a method with a map depends on."""
    chosen: dict[str, Settings] = {
        MIM: settings.intensity,
        PRINTED: settings.printed,
        UNIFORM: _uniform(settings.intensity),
        OCCUPANCY: settings.occupancy,
        GLASS: settings.glass_slam,
    }
    return [settings.drive, chosen[name], settings.score]


def map_source(name: str, field: Field, settings: MapSettings) -> MapSource:
    """The maps of a method, for the robot of a field and its lidar's mounting."""
    robot, mounting = field.robot, field.lidar.base_from_lidar
    if name == OCCUPANCY:
        return OccupancySource(robot, mounting, settings.occupancy)
    if name == GLASS:
        return GlassSlamSource(robot, mounting, settings.glass_slam)
    chosen = {MIM: settings.intensity, PRINTED: settings.printed}
    return IntensitySource(robot, mounting, chosen.get(name) or _uniform(settings.intensity))


def _uniform(settings: IntensityMapSettings) -> IntensityMapSettings:
    inflation: InflationSettings = settings.planning.inflation
    square = inflation.model_copy(update={"form": "uniform"})
    planning = settings.planning.model_copy(update={"inflation": square})
    return settings.model_copy(update={"planning": planning})
