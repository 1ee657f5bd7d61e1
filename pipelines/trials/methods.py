"""The methods that are compared: planners by name, and bundles that drive."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from graspe_data.bundle_contract import CONTRACT_FILE
from graspe_data.calibration import Calibration
from graspe_data.errors import StageError
from graspe_data.manifest import Settings
from graspe_data.sealed_folder import SEAL_FILE
from graspe_data.simulation.field import Field
from pipelines.trials.config import TrialConfig, digest_of
from pipelines.trials.map_methods import MAP_METHODS, map_settings, map_source
from pipelines.trials.map_watch import MapWatch
from pipelines.trials.settings import TrialSettings
from pipelines.trials.situations import Senses
from pipelines.trials.witness import TruthfulScorer, Witness
from planners.bundle import Bundle, load_bundle
from planners.dwa_fox import DwaFox
from planners.dwa_lab import DwaLab
from planners.dwa_map import DwaMap
from planners.fitness import GuardSettings
from planners.goal import GoalSettings
from planners.graspe_planner import GraspePlanner
from planners.guarded import Guarded
from planners.lidar_clouds import LidarClouds
from planners.obstacles import ScanObstacles
from planners.scorer import Scorer
from planners.situation import Planner

FOX, LAB = "dwa_fox", "dwa_lab"
PLANNERS: Final = (FOX, LAB, *MAP_METHODS)
"""Methods without a model."""
TRUTH: Final = "truth"
"""The name under which a bundle's planner asks the world instead of the model."""
VERSION: Final = 5
"""Of trials; raised when the same settings drive otherwise."""
OLDEST_S = 0.5
"""A planner stops for older sensor data, unless the sensors are slower than that."""
ODOMETRY_S = 0.3
"""And for older odometry."""
THINKING_S = 60.0
"""The simulation waits while a planner thinks: only one that hangs is not waited for. Nor does a
planner give up before the referee does."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")


@dataclass(frozen=True)
class Method:
    """A planner without a model, by its name, or a bundle under a name of its own."""

    name: str
    bundle: Path | None = None

    @property
    def senses(self) -> Senses:
        """The sensors that it looks at."""
        return Senses(camera=self.bundle is not None, lidar=True)

    def inputs(self, conditions: str, seed: int, config: TrialConfig) -> str:
        """Digest of all that a trial's result depends on."""
        return digest_of([conditions, seed, self.driver(config)])

    def driver(self, config: TrialConfig) -> str:
        """Digest of who drives: the planner's settings, and the bundle by its seal."""
        seal = None
        if self.bundle is not None:
            seal = hashlib.sha256((self.bundle / SEAL_FILE).read_bytes()).hexdigest()
        settings = [each.model_dump(mode="json") for each in self._settings(config)]
        return digest_of([VERSION, self.name, seal, *settings])

    @property
    def asks_the_world(self) -> bool:
        """Whether the world judges its arcs."""
        return self.bundle is not None and self.name == TRUTH

    @property
    def has_map(self) -> bool:
        """Whether it drives by a map."""
        return self.bundle is None and self.name in MAP_METHODS

    def _settings(self, config: TrialConfig) -> list[Settings]:
        if self.bundle is not None:
            return [config.graspe]
        if self.has_map:
            return map_settings(self.name, config.maps)
        return [config.dwa_fox if self.name == FOX else config.dwa_lab]


def parse_methods(texts: Sequence[str]) -> list[Method]:
    """Methods as the command line names them.

    Args:
        texts: Each one of ``PLANNERS``, ``NAME=BUNDLE``, a bundle, or a folder of bundles, which
            are called as their folders are. A bundle called ``TRUTH`` asks the world.

    Raises:
        StageError: Neither a planner nor a bundle, or a name that two methods have.
    """
    methods = [method for text in texts for method in _parse(text)]
    names = [method.name for method in methods]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise StageError(
            f"--method: {', '.join(twice)} is named more than once: give NAME=BUNDLE, each with a "
            f"name of its own."
        )
    return methods


def make_watch(method: Method, field: Field, config: TrialConfig) -> MapWatch | None:
    """The watched maps of a method that drives by them; None of others."""
    if not method.has_map:
        return None
    return MapWatch(map_source(method.name, field, config.maps), config.maps.score)


def make_witness(method: Method, field: Field) -> Witness | None:
    """Who answers for a method that asks the world; None of others."""
    return Witness(field) if method.asks_the_world else None


def make_planner(
    method: Method,
    field: Field,
    config: TrialConfig,
    threads: int,
    watch: MapWatch | None = None,
    witness: Witness | None = None,
) -> Planner:
    """Set up a method for the robot of a field, guarded against bad input.

    Args:
        method: The planner or the bundle.
        field: Its robot's limits and footprint, and its sensors' calibration, count.
        config: Settings of the planners.
        threads: Of the model.
        watch: The maps that a method drives by; None makes them anew, unwatched.
        witness: Who judges the arcs of a bundle's planner; None leaves it to the model.

    Raises:
        PlannerError: The bundle is damaged, or was made for another robot.
    """
    if method.bundle is not None:
        planner = _by_bundle(load_bundle(method.bundle, threads), field, config, witness)
    elif method.has_map:
        source = watch or map_source(method.name, field, config.maps)
        planner = DwaMap(field.robot, source, config.maps.drive)
    else:
        planner = _by_scan(method.name, field, config)
    return Guarded(planner, field.robot.limits, _guard(method, field, config.trial))


def _by_bundle(
    bundle: Bundle, field: Field, config: TrialConfig, witness: Witness | None
) -> Planner:
    robot, camera, lidar = field.robot, field.camera, field.lidar
    mountings = camera.base_from_camera, lidar.base_from_lidar
    frames = robot.camera.frame, robot.lidar.frame
    calibration = Calibration(camera.intrinsics, *mountings, *frames)
    scorer = (
        TruthfulScorer(bundle, calibration, witness) if witness else Scorer(bundle, calibration)
    )
    return GraspePlanner(robot, scorer, config.graspe)


def _by_scan(name: str, field: Field, config: TrialConfig) -> Planner:
    robot = field.robot
    obstacles = ScanObstacles(
        field.lidar.base_from_lidar,
        robot.base_height,
        robot.lidar.minimum_range,
        clouds=LidarClouds.of(robot),
    )
    if name == FOX:
        return DwaFox(robot, obstacles, config.dwa_fox)
    return DwaLab(robot, obstacles, config.dwa_lab)


def _guard(method: Method, field: Field, settings: TrialSettings) -> GuardSettings:
    camera, lidar = field.scenario.camera, field.scenario.lidar
    turn_s = 1 / lidar.rotation_rate
    return GuardSettings(
        picture_age_s=max(OLDEST_S, 1.5 / camera.rate),
        cloud_age_s=max(OLDEST_S, 1.5 / lidar.rate + turn_s),
        odometry_age_s=max(ODOMETRY_S, 1.5 / field.scenario.rates.odometry),
        needs_picture=method.senses.camera,
        period_s=settings.control_period_s,
        answer_s=THINKING_S,
        goal=GoalSettings(radius=settings.goal_radius, progress_s=2 * settings.time_limit_s),
    )


def _parse(text: str) -> list[Method]:
    if text in PLANNERS:
        return [Method(text)]
    name, equals, place = text.partition("=")
    folder = Path(place if equals else text)
    if equals:
        found = {name: folder} if (folder / CONTRACT_FILE).is_file() else {}
    elif (folder / CONTRACT_FILE).is_file():
        found = {folder.resolve().name: folder}
    else:
        found = {
            path.parent.name: path.parent for path in sorted(folder.glob(f"*/{CONTRACT_FILE}"))
        }
    if not found or not all(_NAME.fullmatch(each) and each not in PLANNERS for each in found):
        raise StageError(
            f"--method {text}: expected {', '.join(PLANNERS)}, NAME=BUNDLE, or the folder of a "
            f"bundle or of several that `graspe export` wrote; names are letters, digits, '_', "
            f"'.' and '-'."
        )
    return [Method(each, path.resolve()) for each, path in found.items()]
