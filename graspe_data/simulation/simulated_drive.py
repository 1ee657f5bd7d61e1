"""A scenario come true: one world, one drive through it, and the sensors that saw it."""

from __future__ import annotations

from dataclasses import dataclass

from graspe_data.robot import Robot
from graspe_data.simulation.field import Field, build_field, part_generator
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drive_robot import drive_robot
from graspe_data.simulation.motion.drivers import Driver
from graspe_data.simulation.motion.random_planner import RandomPlanner
from graspe_data.simulation.scenario import Scenario


@dataclass(frozen=True)
class SimulatedDrive(Field):
    """One drive of a scenario with everything that its sensors need."""

    driven: Drive

    @classmethod
    def through(cls, field: Field, driven: Drive) -> SimulatedDrive:
        """A drive through a field, whoever drove."""
        return cls(**vars(field), driven=driven)


def simulate_drive(
    scenario: Scenario, robot: Robot, seed: int, threads: int = 0, driver: Driver | None = None
) -> SimulatedDrive:
    """Build the world of a seed and drive through it.

    Args:
        scenario: The scenario.
        robot: Its limits and footprint count.
        seed: Of everything that is drawn.
        threads: For rays; 0 uses every core. The answer does not depend on it.
        driver: Who drives; None is the scenario's random planner.

    Raises:
        ManifestError: The world cannot be built as the scenario asks.
    """
    field = build_field(scenario, robot, seed, threads)
    if driver is None:
        drawn = part_generator(scenario, seed, "planner")
        driver = RandomPlanner(field.world, robot, scenario.planner, drawn)
    motion = part_generator(scenario, seed, "motion")
    duration_s = scenario.duration_s
    driven = drive_robot(field.world, robot, driver, scenario.motion, duration_s, motion)
    return SimulatedDrive.through(field, driven)
