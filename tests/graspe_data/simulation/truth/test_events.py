"""The failures of constructed drives, and what the label rules find of those of random ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from graspe_data.observation.labels import (
    CommandSeries,
    Event,
    InertialSeries,
    MotionSeries,
    OdometrySeries,
    ProposalSettings,
    propose,
)
from graspe_data.robot import Robot
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drive_robot import drive_robot
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from graspe_data.simulation.motion.motion_settings import MotionSettings
from graspe_data.simulation.motion.planner_settings import PlannerSettings
from graspe_data.simulation.motion.random_planner import RandomPlanner
from graspe_data.simulation.truth.events import true_events
from graspe_data.simulation.world.obstacles import Obstacle
from graspe_data.simulation.world.world import World

WorldOf = Callable[..., World]
DriveOf = Callable[..., Drive]

WALL = Obstacle((3.0, -5.0), (3.0, 5.0), 0.1, "stops", "concrete")
BUSH = Obstacle((3.0, 0.0), (3.0, 0.0), 1.0, "entangles", "bush", 0.15)
GRASS = Obstacle((3.0, 0.0), (3.0, 0.0), 2.0, "slows", "grass", 0.5)
ROCK = Obstacle((2.0, 0.0), (2.0, 0.0), 0.15, "stumbles", "rock", 0.15)


def test_a_free_drive_has_no_failures(world_of: WorldOf, scripted: DriveOf) -> None:
    script = [Leg(5.0, 0.5, 0.3), Leg(2.0, 0.0, 0.0), Leg(3.0, -0.4, 0.0), Leg(4.0, 0.0, 0.5)]
    assert true_events(scripted(world_of(GRASS), script)) == []


def test_a_robot_that_pushes_against_a_wall_has_collided_and_is_stuck(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    drive = scripted(world_of(WALL), [Leg(8.0, 0.5, 0.0), Leg(3.0, -0.4, 0.0)])
    collision, stuck = true_events(drive)
    # The front is 2.35 m from the wall; the start takes a quarter of a second more.
    hits = 2.35 / 0.5 + 0.25
    assert (collision.kind, stuck.kind) == ("collision", "stuck")
    assert collision.start_ns * 1e-9 == pytest.approx(hits, abs=0.03)
    assert stuck.start_ns * 1e-9 == pytest.approx(hits, abs=0.03)
    assert stuck.stop_ns * 1e-9 == pytest.approx(8.1, abs=0.05)
    assert (collision.evidence, stuck.evidence) == ("0.50 m/s", "blocked")


def test_a_robot_in_a_bush_is_stuck_from_a_fifth_of_its_speed_and_has_not_collided(
    world_of: WorldOf, scripted: DriveOf
) -> None:
    drive = scripted(world_of(BUSH), [Leg(8.0, 0.5, 0.0), Leg(3.0, -0.4, 0.0)])
    (stuck,) = true_events(drive)
    entered = (2.0 - 0.55) / 0.5 + 0.25
    assert (stuck.kind, stuck.evidence) == ("stuck", "entangled")
    assert stuck.start_ns * 1e-9 == pytest.approx(entered + 4 * 0.15 / 0.5, abs=0.05)


def test_held_for_less_than_a_second_it_is_not_stuck(world_of: WorldOf, scripted: DriveOf) -> None:
    drive = scripted(world_of(WALL), [Leg(5.6, 0.5, 0.0), Leg(3.0, -0.4, 0.0)])
    assert [event.kind for event in true_events(drive)] == ["collision"]


def test_a_rock_makes_a_stumble(
    world_of: WorldOf, scripted: DriveOf, exact: MotionSettings
) -> None:
    sure = exact.model_copy(update={"mechanics": MechanicsSettings(stumble_height=0.001)})
    (stumble,) = true_events(scripted(world_of(ROCK), [Leg(8.0, 0.5, 0.0)], sure))
    assert stumble.kind == "stumble"
    assert (stumble.stop_ns - stumble.start_ns) * 1e-9 == pytest.approx(0.39)


def field(world_of: WorldOf, seed: int) -> World:
    drawn = np.random.default_rng(seed)
    centres = drawn.uniform((-20.0, -15.0), (20.0, 15.0), (200, 2))
    centres = centres[np.hypot(*centres.T) > 2.5]
    kinds: list[tuple[str, str, float]] = [
        ("stops", "bark", 0.2),
        ("entangles", "bush", 0.6),
        ("slows", "grass", 2.0),
    ]
    things = []
    for index, (x, y) in enumerate(centres.tolist()):
        effect, material, radius = kinds[index % 3]
        strength = {"stops": 0.0, "entangles": 0.15, "slows": 0.8}[effect]
        things.append(Obstacle((x, y), (x, y), radius, effect, material, strength))  # type: ignore[arg-type]
    return world_of(*things)


def series(drive: Drive) -> MotionSeries:
    """Odometry at 50 Hz, commands at 10 Hz, inertial samples at 100 Hz."""
    stamps = np.rint(drive.time_s * 1e9).astype(np.int64)
    odometry = OdometrySeries(
        stamps[::2],
        *drive.odometry[::2].T,
        *drive.measured[::2].T,
        *drive.attitude[::2, :2].T,
    )
    command = CommandSeries(stamps[::10], *drive.command[::10].T)
    return MotionSeries(odometry, command, InertialSeries(stamps, drive.gyro, drive.acceleration))


def shares(truth: Sequence[Event], found: Sequence[Event], kind: str) -> tuple[int, int, int, int]:
    """How many are true, of these found; and proposed, of these true."""
    real = [event for event in truth if event.kind == kind]
    proposed = [event for event in found if event.kind == kind]
    return (
        len(real),
        sum(event.meets(proposed) for event in real),
        len(proposed),
        sum(event.meets(real) for event in proposed),
    )


def test_the_label_rules_find_what_holds_a_robot(world_of: WorldOf, spot: Robot) -> None:
    counts = np.zeros(4, int)
    for seed in range(5):
        world = field(world_of, seed)
        generator = np.random.default_rng(seed)
        planner = RandomPlanner(world, spot, PlannerSettings(caution=0.2), generator.spawn(1)[0])
        drive = drive_robot(world, spot, planner, MotionSettings(), 90.0, generator)
        found = propose(series(drive), ProposalSettings()).events
        counts += shares(true_events(drive), found, "stuck")
    real, recalled, proposed, correct = counts.tolist()
    assert real >= 10
    assert recalled / real >= 0.8  # .93 of 292; the drives differ from processor to processor
    assert correct / proposed >= 0.9
