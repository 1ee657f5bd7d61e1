"""Record a scenario, as a robot's own recorder would, with the truth on topics of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.known_outcomes import KnownOutcomes
from graspe_data.recordings.writing import Compression, Container, RecordingWriter
from graspe_data.robot import Limits, Robot
from graspe_data.simulation.field import part_generator
from graspe_data.simulation.habits.recorded import Habit, Recorded, with_habits
from graspe_data.simulation.habits.robots import habits_of
from graspe_data.simulation.message_stream import START_NS, MessageStream, stamp_of
from graspe_data.simulation.messages import Messages
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.recorded_truth import (
    CANDIDATES_TOPIC,
    EVENTS_TOPIC,
    SCENARIO_TOPIC,
    TRAJECTORIES_TOPIC,
    RecordedTruth,
    scenario_text,
    write_truth_annotation,
)
from graspe_data.simulation.scenario import Scenario
from graspe_data.simulation.simulated_drive import SimulatedDrive, simulate_drive
from graspe_data.simulation.truth.events import true_events
from graspe_data.simulation.truth.outlook import anchor_success, candidate_success

ARC_STEPS = 10
ARC_STEP_S = 0.3
CANDIDATES = 8
SLOWEST_SHARE = 0.25
JITTER_NS = 2_000_000


def record_scenario(
    scenario: Scenario,
    robot: Robot,
    seed: int,
    path: Path,
    container: Container,
    compression: Compression = "none",
    threads: int = 0,
    habits: str | None = None,
) -> RecordedTruth:
    """Simulate a scenario and record it, as ``record_drive`` does.

    Args:
        scenario: The scenario.
        robot: Its topics, frames, limits and footprint.
        seed: Of everything that is drawn.
        path: The file or folder to create.
        container: ``bag``, ``db3`` or ``mcap``.
        compression: One that the container has.
        threads: For rays; 0 uses every core.
        habits: A robot that ships, whose drivers write; None writes as the simulator does.

    Raises:
        ManifestError: The world cannot be built as the scenario asks, or no such habits are known.
        RecordingError: The path exists, or cannot be written.
    """
    own = () if habits is None else habits_of(habits, robot)
    simulated = simulate_drive(scenario, robot, seed, threads)
    return record_drive(simulated, path, container, compression, own, habits)


def record_drive(
    simulated: SimulatedDrive,
    path: Path,
    container: Container,
    compression: Compression = "none",
    habits: Sequence[Habit] = (),
    habits_name: str | None = None,
) -> RecordedTruth:
    """Record a drive, whoever drove, with ``<path>.truth.yaml`` beside.

    The same drive gives the same bytes, and every container tells the same. Each message reaches
    the recorder some milliseconds after its stamp.

    Args:
        simulated: The drive.
        path: The file or folder to create.
        container: ``bag``, ``db3`` or ``mcap``.
        compression: One that the container has.
        habits: What a robot's drivers do to the messages.
        habits_name: Said in the recording beside its scenario.

    Raises:
        RecordingError: The path exists, or cannot be written.
    """
    truth = _truth(simulated)
    scenario = scenario_text(simulated.scenario, simulated.robot, simulated.seed, habits_name)
    with RecordingWriter(path, container, compression) as writer:
        for message in with_habits(_messages(simulated, truth, scenario), habits):
            writer.write(message.topic, message.content, message.bag_time_ns)
    write_truth_annotation(path, truth, START_NS)
    return truth


def _messages(simulated: SimulatedDrive, truth: RecordedTruth, scenario: str) -> Iterator[Recorded]:
    """All messages of a recording, as they reach the recorder."""
    arcs, candidates = iter(truth.trajectory_texts()), iter(_outcomes(simulated).texts())
    text = Messages(simulated.robot).text
    jitter = part_generator(simulated.scenario, simulated.seed, "jitter")
    yield Recorded(SCENARIO_TOPIC, text(scenario), START_NS)
    for message in MessageStream(simulated):
        late = message.delay_ns + int(jitter.integers(0, JITTER_NS))
        yield Recorded(message.topic, message.content, message.stamp_ns + late)
        if message.topic == simulated.robot.topics.image:
            yield Recorded(TRAJECTORIES_TOPIC, text(next(arcs)), message.stamp_ns)
            yield Recorded(CANDIDATES_TOPIC, text(next(candidates)), message.stamp_ns)
    yield Recorded(EVENTS_TOPIC, text(truth.events_text()), _end_ns(simulated))


def _truth(simulated: SimulatedDrive) -> RecordedTruth:
    """The drive's failures, and how the arc of every picture would have ended."""
    driven, steps = simulated.driven, _pictures(simulated)
    success = anchor_success(
        simulated.world,
        simulated.robot,
        driven,
        driven.time_s[steps],
        ARC_STEPS,
        ARC_STEP_S,
        simulated.scenario.motion.mechanics,
    )
    events = tuple(
        replace(event, start_ns=event.start_ns + START_NS, stop_ns=event.stop_ns + START_NS)
        for event in true_events(driven)
    )
    return RecordedTruth(
        events, np.array([stamp_of(int(step)) for step in steps]), success, ARC_STEP_S
    )


def _outcomes(simulated: SimulatedDrive) -> KnownOutcomes:
    """Candidates forward, drawn from the robot's limits, and how each would have ended."""
    steps = _pictures(simulated)
    drawn = part_generator(simulated.scenario, simulated.seed, "candidates")
    velocities = draw_candidates(simulated.robot.limits, len(steps), drawn)
    success = candidate_success(
        simulated.world,
        simulated.robot,
        simulated.driven,
        steps,
        velocities,
        ARC_STEPS,
        ARC_STEP_S,
        simulated.scenario.motion.mechanics,
    )
    stamps = np.array([stamp_of(int(step)) for step in steps])
    return KnownOutcomes(stamps, velocities, success, ARC_STEP_S)


def draw_candidates(limits: Limits, pictures: int, generator: np.random.Generator) -> Floats:
    """Velocities forward within a robot's limits, v and omega in m/s and rad/s.

    Returns:
        float64 (pictures, CANDIDATES, 2), to a tenth of a mm/s.
    """
    fastest, shape = limits.linear_velocity[1], (pictures, CANDIDATES)
    linear = generator.uniform(SLOWEST_SHARE * fastest, fastest, shape)
    yaw_rate = generator.uniform(*limits.yaw_rate, shape)
    return np.stack([linear, yaw_rate], axis=2).round(4)


def _pictures(simulated: SimulatedDrive) -> NDArray[np.intp]:
    """The steps at which the camera takes a picture."""
    every = round(1 / simulated.scenario.camera.rate / STEP_S)
    return np.arange(0, len(simulated.driven.time_s), every)


def _end_ns(simulated: SimulatedDrive) -> int:
    return stamp_of(len(simulated.driven.time_s))
