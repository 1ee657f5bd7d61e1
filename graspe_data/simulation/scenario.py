"""A scenario: the world, the robot's way through it, its sensors, and what befalls them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from graspe_data.manifest import Settings, find_manifest, load_manifest
from graspe_data.robot import Robot
from graspe_data.simulation.camera.light import LightSettings
from graspe_data.simulation.camera.settings import CameraSettings
from graspe_data.simulation.lidar.settings import LidarSettings
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.motion.planner_settings import PlannerSettings
from graspe_data.simulation.occlusions import Occlusion
from graspe_data.simulation.world.settings import WorldSettings

Rate = Annotated[float, Field(ge=0.01, le=1 / STEP_S)]

FARTHEST_MOUNT = 10.0
"""Metres along an axis of base_link."""


class Rates(Settings):
    """How often the robot itself reports, Hz."""

    odometry: Rate = 50.0
    """And the transform from the odometry's frame to the base."""
    imu: Rate = 100.0
    command: Rate = 10.0


class Scenario(Settings):
    """A scenario; with a seed it is a recording."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", max_length=100)]
    about: str = ""
    """What it is for, in a sentence."""
    robot: str = "spot"
    """A robot manifest: the name of one that ships, or a path beside this file."""
    duration_s: Annotated[float, Field(ge=1, le=36_000)] = 60.0
    world: WorldSettings
    light: LightSettings = LightSettings()
    camera: CameraSettings = CameraSettings()
    lidar: LidarSettings = LidarSettings()
    rates: Rates = Rates()
    motion: MotionSettings = MotionSettings()
    planner: PlannerSettings = PlannerSettings()
    occlusions: Annotated[tuple[Occlusion, ...], Field(max_length=16)] = ()
    goal: tuple[float, float] | None = None
    """Where a trial ends, x and y in metres; a recording does without."""

    @model_validator(mode="after")
    def _on_steps(self) -> Self:
        rates = {"camera.rate": self.camera.rate, "lidar.rate": self.lidar.rate}
        rates |= {f"rates.{name}": rate for name, rate in self.rates}
        for name, rate in rates.items():
            steps = 1 / (rate * STEP_S)
            if steps < 1 - 1e-9 or abs(steps - round(steps)) > 1e-6:  # noqa: PLR2004
                raise ValueError(
                    f"{name}: {rate:g} Hz does not fit the simulation's step of {STEP_S:g} s; "
                    f"expected {1 / STEP_S:g} Hz divided by a whole number, such as 5, 10 or 20"
                )
        return self

    @model_validator(mode="after")
    def _sees_a_cloud(self) -> Self:
        if 1 / self.lidar.rate > self.duration_s + STEP_S / 2:
            raise ValueError(
                f"lidar.rate: {self.lidar.rate:g} Hz may give no cloud in {self.duration_s:g} s: "
                f"raise it to {1 / self.duration_s:g} Hz, or duration_s"
            )
        return self

    @model_validator(mode="after")
    def _mounted_on_the_robot(self) -> Self:
        for name, sensor in (("camera", self.camera), ("lidar", self.lidar)):
            place = sensor.mounting.translation
            if any(abs(axis) > FARTHEST_MOUNT for axis in place):
                raise ValueError(
                    f"{name}.mounting.translation: {list(place)} is more than "
                    f"{FARTHEST_MOUNT:g} m from base_link"
                )
        return self

    @model_validator(mode="after")
    def _goal_within(self) -> Self:
        if self.goal is None:
            return self
        half = (self.world.length / 2, self.world.width / 2)
        if any(abs(place) > most for place, most in zip(self.goal, half, strict=True)):
            raise ValueError(
                f"goal: {self.goal} lies outside of the arena, which reaches to "
                f"x = +-{half[0]:g} m and y = +-{half[1]:g} m"
            )
        return self


def load_scenario(name: str | Path) -> tuple[Scenario, Robot]:
    """Load a scenario, by path or by the name of one that ships, and the robot that it names.

    Raises:
        ManifestError: Either manifest is missing or does not validate.
    """
    path = find_manifest("scenarios", name)
    scenario = load_manifest(path, Scenario)
    robot = load_manifest(find_manifest("robots", scenario.robot, beside=path.parent), Robot)
    return scenario, robot
