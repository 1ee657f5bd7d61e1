"""Why trials failed, told from logbooks made by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from graspe_data.simulation.field import Field
from graspe_data.simulation.motion.mechanics import MechanicsSettings
from pipelines.trials.failures import explain
from pipelines.trials.logbook import Logbook, LogEntry
from pipelines.trials.trial import Outcome, Pose
from planners.situation import Command, Considered

FREE: Pose = (-3.0, 0.0, 0.0)
AT_WALL: Pose = (0.3, 0.0, 0.0)
ONWARD = np.array([[0.3, 0.0], [0.3, 0.2]])


def scored(chosen: int | None, success: float, velocity: tuple[float, float]) -> Command:
    considered = Considered(
        ONWARD, np.zeros(len(ONWARD)), np.full((len(ONWARD), 10), success, np.float32), chosen
    )
    return Command(*velocity, considered=considered)


def entries(command: Command, pose: Pose, count: int = 20) -> list[LogEntry]:
    return [LogEntry(20 + 10 * index, pose, command, 0.01) for index in range(count)]


@pytest.fixture(scope="module")
def walled(lane_of: Any, wall: dict[str, Any]) -> Field:
    field: Field = lane_of(wall)
    return field


def explained(field: Field, answers: list[LogEntry], outcome: Outcome, pose: Pose) -> Any:
    logbook = Logbook(field.world, field.robot, MechanicsSettings(), answers)
    return explain(logbook, outcome, answers[-1].step + 10, pose, 20.0)


def test_a_model_that_accepted_what_fails_perceived_wrongly(walled: Field) -> None:
    accepted = scored(0, 0.9, (0.3, 0.0))
    found = explained(walled, entries(accepted, AT_WALL), "collision", (0.44, 0.0, 0.0))
    assert (found.kind, found.free, found.obstacle) == ("perception", False, "concrete")
    assert found.predicted == pytest.approx(0.9)
    assert found.told == (0.3, 0.0)


def test_without_a_model_a_collision_is_the_planners(walled: Field) -> None:
    blind = entries(Command(0.3, 0.0), AT_WALL)
    found = explained(walled, blind, "collision", (0.44, 0.0, 0.0))
    assert (found.kind, found.predicted) == ("planner", None)


def test_a_contact_off_the_accepted_arcs_is_the_planners(walled: Field) -> None:
    accepted = scored(0, 0.9, (0.3, 0.0))
    found = explained(walled, entries(accepted, FREE), "stuck", (0.44, 0.0, 0.0))
    assert (found.kind, found.free) == ("planner", True)


def test_rejecting_arcs_that_get_through_is_the_threshold(walled: Field) -> None:
    rejected = scored(None, 0.1, (0.0, 0.3))
    assert explained(walled, entries(rejected, FREE), "stalled", FREE).kind == "threshold"


def test_where_no_arc_gets_through_it_is_the_world(walled: Field) -> None:
    rejected = scored(None, 0.1, (0.0, 0.0))
    assert (
        explained(walled, entries(rejected, (0.43, 0.0, 0.0)), "stalled", AT_WALL).kind == "world"
    )


def test_a_way_that_was_no_candidate_is_the_planners(lane_of: Any) -> None:
    ahead = {"kind": "pillar", "at": [[-1.55, 0.1]], "radius": [0.2, 0.2]}
    field = lane_of(ahead)
    rejected = scored(None, 0.1, (0.0, 0.0))
    assert explained(field, entries(rejected, FREE), "stalled", FREE).kind == "planner"


def test_moving_to_and_fro_without_getting_on_is_the_planners(walled: Field) -> None:
    answers = [*entries(scored(0, 0.9, (0.3, 0.0)), FREE, 12), *entries(Command(0.0, 0.0), FREE, 8)]
    assert explained(walled, answers, "timeout", FREE).kind == "planner"


def test_a_success_needs_no_explanation(walled: Field) -> None:
    assert explained(walled, entries(Command(0.3, 0.0), FREE), "success", FREE) is None
