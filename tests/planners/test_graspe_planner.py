"""Section IV-G: equation (8), the order of Q, and what the model accepts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from graspe_data.calibration import Calibration
from graspe_data.robot import Robot
from planners.bundle import Bundle
from planners.graspe_planner import GraspePlanner, GraspePlannerSettings
from planners.guarded import Guarded
from planners.observe import ObservedRow
from planners.scorer import Scene, Scorer
from planners.situation import Situation
from tests.planners.conftest import Situations

AHEAD = tuple((0.9, y) for y in (-0.4, -0.2, 0.0, 0.2, 0.4))
"""Posts so near that nothing but a rotation is admissible at speed."""


class Reliable(Scorer):
    """A scorer whose cloud has a given reliability, and that counts its calls."""

    def __init__(self, bundle: Bundle, calibration: Calibration, r_point: float) -> None:
        super().__init__(bundle, calibration)
        self.r_point, self.calls = r_point, 0

    def scene(self, situation: Situation) -> Scene:
        scene = super().scene(situation)
        known = scene.observation
        return replace(scene, observation=ObservedRow(known.columns, known.r_img, self.r_point))

    def judge(self, scene: Scene, velocities: np.ndarray) -> np.ndarray:
        self.calls += 1
        return super().judge(scene, velocities)


def test_a_clear_way_is_driven(
    robot: Robot, bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    command = GraspePlanner(robot, Scorer(bundle, calibration)).command(situation())
    assert command.reason == ""
    assert command.linear_velocity == pytest.approx(0.6)
    assert command.yaw_rate == pytest.approx(0.0)


def test_the_best_of_what_the_model_accepts_is_driven_though_q_prefers_the_left(
    robot: Robot, bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    scorer = Reliable(bundle, calibration, 0.9)
    command = GraspePlanner(robot, scorer).command(situation(goal=(6.0, 6.0)))
    considered = command.considered
    assert considered is not None
    assert considered.success is not None
    assert considered.chosen is not None
    accepted = considered.success.min(axis=1) >= 0.5
    assert not accepted[np.argmax(considered.objective)]
    assert considered.objective[considered.chosen] == considered.objective[accepted].max()
    driven = considered.velocities[considered.chosen].tolist()
    assert [command.linear_velocity, command.yaw_rate] == driven
    assert scorer.calls == 1


@pytest.mark.parametrize(
    ("r_point", "first_branch"), [(0.0, True), (0.4, True), (np.nextafter(0.4, 1), False)]
)
def test_equation_8_drops_the_collision_free_set_at_r_th(
    robot: Robot,
    bundle: Bundle,
    calibration: Calibration,
    situation: Situations,
    r_point: float,
    first_branch: bool,
) -> None:
    planner = GraspePlanner(robot, Reliable(bundle, calibration, r_point))
    command = planner.command(situation(posts=AHEAD))
    assert command.considered is not None
    fast = command.considered.velocities[:, 0] > 0.5
    assert fast.any() == first_branch


def test_thresholds_can_be_set(
    robot: Robot, bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    dim = situation(grey=51)
    scorer = Scorer(bundle, calibration)
    assert GraspePlanner(robot, scorer).command(dim).reason
    bold = GraspePlannerSettings(acceptance=0.3)
    assert GraspePlanner(robot, scorer, bold).command(dim).reason == ""
    wary = GraspePlanner(
        robot, Reliable(bundle, calibration, 0.0), GraspePlannerSettings(reliability=0)
    )
    assert wary.command(situation(posts=AHEAD)).linear_velocity > 0


def test_in_the_dark_a_model_that_rejects_all_candidates_looks_around(
    robot: Robot, bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    command = GraspePlanner(robot, Scorer(bundle, calibration)).command(situation(grey=0))
    assert command.linear_velocity == 0
    assert abs(command.yaw_rate) == pytest.approx(0.4)
    assert command.reason == "no candidate is accepted: turning on the spot"


@pytest.mark.parametrize(("goal", "side"), [((-3.0, 3.0), 1), ((-3.0, -3.0), -1)])
def test_a_model_of_the_whole_scene_turns_where_it_rejects(
    robot: Robot,
    scene_bundle: Bundle,
    calibration: Calibration,
    situation: Situations,
    goal: tuple[float, float],
    side: int,
) -> None:
    planner = GraspePlanner(robot, Scorer(scene_bundle, calibration))
    command = planner.command(situation(grey=20, goal=goal))
    assert command.linear_velocity == 0
    assert np.sign(command.yaw_rate) == side
    assert command.reason == "no candidate is accepted: turning on the spot"
    assert planner.command(situation(grey=200)).reason == ""


def test_a_rotation_under_way_goes_on(
    robot: Robot, scene_bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    planner = GraspePlanner(robot, Scorer(scene_bundle, calibration))
    for omega in (-0.3, 0.3):
        moment = situation(grey=20, goal=(5.0, 3.0), velocity=(0.0, omega))
        assert np.sign(planner.command(moment).yaw_rate) == np.sign(omega)


def test_guarded_it_survives_what_sensors_do(
    robot: Robot, bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    guarded = Guarded(GraspePlanner(robot, Scorer(bundle, calibration)), robot.limits)
    good = situation()
    assert good.cloud is not None
    empty = replace(good.cloud, xyz=np.empty((0, 3), np.float32), ring=np.empty(0, np.int32))
    for bad in (
        replace(good, picture=None),
        replace(good, motions=()),
        replace(good, motions=good.motions[-3:]),
        replace(good, velocity=(float("nan"), 0.0)),
        replace(good, cloud=empty),
    ):
        command = guarded.command(bad)
        assert command.reason.startswith("stop: ")
    assert guarded.command(good).reason == ""
