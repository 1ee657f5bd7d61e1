"""The field of a scenario and a seed: the world, and the sensors of the robot in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graspe_data.errors import ManifestError
from graspe_data.robot import Robot
from graspe_data.simulation.camera.camera import Camera
from graspe_data.simulation.camera.light import draw_light
from graspe_data.simulation.lidar.lidar import Lidar
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.motion.footprint import clearance
from graspe_data.simulation.occlusions import Covers, draw_covers
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.scenario import Scenario
from graspe_data.simulation.world.build_world import build_world
from graspe_data.simulation.world.streams import stream
from graspe_data.simulation.world.world import World


@dataclass(frozen=True)
class Field:
    """A world with everything that a robot's sensors need to see it."""

    scenario: Scenario
    robot: Robot
    seed: int
    world: World
    camera: Camera
    lidar: Lidar
    covers: Covers

    @property
    def lidar_phase(self) -> int:
        """Steps from a picture to the turn of the lidar that is published next.

        A lidar turns freely: its phase to the camera is another in every recording.
        """
        turn = round(1 / self.scenario.lidar.rotation_rate / STEP_S)
        return int(part_generator(self.scenario, self.seed, "lidar phase").integers(turn))


def build_field(
    scenario: Scenario, robot: Robot, seed: int, threads: int = 0, *, front_only: bool = False
) -> Field:
    """Build the world of a seed, its light, and what will cover the sensors.

    Args:
        scenario: The scenario; covers are drawn for its duration.
        robot: Its footprint counts.
        seed: Of everything that is drawn.
        threads: For rays; 0 uses every core. The answer does not depend on it.
        front_only: The lidar leaves out the beams that return nothing from ahead of the robot.

    Raises:
        ManifestError: The world cannot be built as the scenario asks.
    """
    world = scenario_world(scenario, seed)
    _check_birth(world, robot)
    light = draw_light(scenario.light, part_generator(scenario, seed, "light"))
    drawn = part_generator(scenario, seed, "occlusions")
    scene = RayScene(world.surfaces, threads)
    return Field(
        scenario=scenario,
        robot=robot,
        seed=seed,
        world=world,
        camera=Camera(world, scene, light, scenario.camera),
        lidar=Lidar(world, scene, scenario.lidar, front_only=front_only),
        covers=draw_covers(scenario.occlusions, scenario.duration_s, drawn),
    )


def scenario_world(scenario: Scenario, seed: int) -> World:
    """The world of a scenario and a seed.

    Raises:
        ManifestError: It cannot be built as the scenario asks.
    """
    return build_world(scenario.world, scenario.name, seed)


def part_generator(scenario: Scenario, seed: int, part: str, *more: int) -> np.random.Generator:
    """The generator of one part of a simulation: what one draws changes no other.

    Scenarios of other names draw otherwise from the same seed; ``more`` numbers it further.
    """
    return stream(scenario.name, seed, part, *more)


def _check_birth(world: World, robot: Robot) -> None:
    """Refuse a robot whose footprint at the start is in what stops or entangles it."""
    solid = world.obstacles.having("stops", "entangles")
    gaps = clearance(robot.footprint, np.array([world.start]), solid)[0]
    if gaps.min(initial=np.inf) >= 0:
        return
    worst = int(gaps.argmin())
    x, y = solid.start[worst]
    raise ManifestError(
        f"world.start: the {robot.footprint.length:g} m by {robot.footprint.width:g} m of the "
        f"robot {robot.name!r} would be born {-gaps[worst]:.2f} m deep in the "
        f"{solid.material[worst]} at ({x:g}, {y:g}): raise start_clearance, or move one of them."
    )
