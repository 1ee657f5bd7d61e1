"""Trials in a lane: how they end, and what planners are told on the way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from graspe_data.errors import ManifestError, StageError
from graspe_data.simulation.field import Field
from graspe_data.simulation.message_stream import START_NS
from graspe_data.simulation.scenario import load_scenario
from pipelines.trials.run_trial import trial_scenario
from pipelines.trials.settings import TrialSettings
from pipelines.trials.situations import Senses


def test_who_drives_to_the_goal_arrives(aims: Any, drives: Any) -> None:
    run, trial = drives(aims())
    assert (run.outcome, trial.failure, trial.collisions) == ("success", None, 0)
    assert np.hypot(*(run.drive.position[-1, :2] - (3.0, 0.0))) <= 0.6
    assert trial.straight_m == pytest.approx(5.4)
    assert 1.0 <= trial.normalised_length < 1.05
    assert trial.arcs == trial.arcs_free == trial.control.answers
    assert trial.duration_s == pytest.approx(len(run.drive.time_s) * 0.01)


def test_the_path_is_the_true_way_from_start_to_end(aims: Any, drives: Any) -> None:
    run, trial = drives(aims())
    assert trial.path[0] == trial.start == (-3.0, 0.0, 0.5)
    assert trial.path[-1][:2] == pytest.approx(tuple(run.drive.position[-1, :2]), abs=1e-3)
    apart = np.hypot(*np.diff(np.array(trial.path)[:, :2], axis=0).T)
    assert apart.max() <= 0.6 * trial.path_step_s + 2e-3


@pytest.mark.parametrize(
    ("velocity", "changes", "outcome"),
    [
        ((0.0, 0.0), {"stalled_s": 3.0}, "stalled"),
        ((0.0, 0.6), {"stalled_s": 3.0}, "stalled"),
        ((0.3, 0.6), {"stalled_s": 30.0, "time_limit_s": 5.0}, "timeout"),
        ((0.6, 0.0), {}, "left_arena"),
    ],
)
def test_who_does_not_arrive_fails_by_what_became_of_it(
    velocity: tuple[float, float], changes: dict[str, float], outcome: str, holds: Any, drives: Any
) -> None:
    run, trial = drives(holds(*velocity), **changes)
    assert run.outcome == trial.outcome == outcome
    assert trial.failure is not None
    assert trial.failure.kind == "planner"
    assert trial.failure.told == velocity


def test_a_wall_ends_the_trial_at_the_impact(aims: Any, drives: Any, wall: dict[str, Any]) -> None:
    run, trial = drives(aims(), [wall])
    assert (trial.outcome, trial.collisions) == ("collision", 1)
    assert trial.failure is not None
    assert (trial.failure.obstacle, trial.failure.free) == ("concrete", False)
    hit = int(np.argmax(run.drive.contacts.impact >= 0.1))
    assert len(run.drive.time_s) - hit <= 10


def test_a_bush_holds_the_robot_until_it_counts_as_stuck(
    aims: Any, drives: Any, bush: dict[str, Any]
) -> None:
    run, trial = drives(aims(), [bush], stuck_s=2.0)
    assert (trial.outcome, trial.stuck) == ("stuck", 1)
    assert trial.failure is not None
    assert trial.failure.obstacle == "bush"
    held = np.abs(run.drive.velocity[:, 0]) < 0.2 * 0.6
    lasting = np.argmax(~held[::-1]) * 0.01
    assert 1.9 <= lasting <= 2.3


def test_the_same_seed_gives_the_same_trial_and_another_seed_another(
    aims: Any, drives: Any
) -> None:
    paths = [drives(aims(), seed=seed)[1].path for seed in (1, 1, 2)]
    assert paths[0] == paths[1] != paths[2]


def test_other_senses_leave_slip_and_odometry_as_they_are(aims: Any, drives: Any) -> None:
    blind, seeing = aims(), aims()
    paths = [
        drives(planner, senses=Senses(camera=sees, lidar=sees), time_limit_s=1.5)[1].path
        for planner, sees in ((blind, False), (seeing, True))
    ]
    assert paths[0] == paths[1]
    assert blind.asked[-1].picture is None
    assert blind.asked[-1].cloud is None


def test_the_goal_is_told_in_the_odometry_frame(aims: Any, drives: Any) -> None:
    planner = aims()
    drives(planner)
    goal = 6.0 * np.array([np.cos(0.5), -np.sin(0.5)])
    assert planner.asked[0].goal == pytest.approx(tuple(goal))
    assert planner.asked[0].pose == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
    x, y, _ = planner.asked[-1].pose
    assert np.hypot(goal[0] - x, goal[1] - y) < 1.0


def test_sensors_are_no_newer_and_hardly_older_than_on_a_robot(aims: Any, drives: Any) -> None:
    planner = aims()
    drives(planner, senses=Senses(), time_limit_s=2.0)
    assert planner.asked[0].now_ns == START_NS + 200_000_000
    for moment in planner.asked:
        assert 20e6 <= moment.now_ns - moment.picture.stamp_ns <= 230e6
        assert 50e6 <= moment.now_ns - moment.cloud.stamp_ns <= 310e6
        assert moment.picture.rgb.shape == (60, 80, 3)
        assert len(moment.cloud.xyz) > 1000
    assert len({moment.picture.stamp_ns for moment in planner.asked}) == 10


def test_the_history_reaches_back_before_the_start(aims: Any, drives: Any) -> None:
    planner = aims()
    drives(planner, history_s=5.0, time_limit_s=1.0)
    motions = planner.asked[0].motions
    stamps = np.array([motion.stamp_ns for motion in motions])
    assert (np.diff(stamps) == 20_000_000).all()
    assert planner.asked[0].now_ns - stamps[0] >= 5e9
    assert all(motion.linear_velocity == 0 for motion in motions if motion.stamp_ns < START_NS)
    assert all(len(moment.motions) == len(motions) for moment in planner.asked)


def test_commands_are_held_for_the_control_period(aims: Any, drives: Any) -> None:
    planner = aims()
    run, _ = drives(planner, control_period_s=0.25, time_limit_s=2.0)
    assert set(np.diff([moment.now_ns for moment in planner.asked])) == {250_000_000}
    assert len(run.logbook.entries) == len(planner.asked)


def test_reasons_of_safe_commands_are_counted(holds: Any, drives: Any) -> None:
    _, trial = drives(holds(0.0, reason="stop: no picture"), stalled_s=2.0)
    assert trial.safe_commands == {"stop: no picture": trial.control.answers}


def test_a_command_that_is_none_is_refused(holds: Any, drives: Any) -> None:
    with pytest.raises(StageError, match="which no robot can drive"):
        drives(holds(float("nan")))


def test_a_scenario_without_a_goal_is_refused() -> None:
    meadow, _ = load_scenario("meadow")
    with pytest.raises(StageError, match=r"meadow: a trial needs a goal.*add `goal: \[x, y\]`"):
        trial_scenario(meadow, TrialSettings())


def test_a_goal_can_be_given_to_any_scenario() -> None:
    meadow, _ = load_scenario("meadow")
    assert trial_scenario(meadow, TrialSettings(), (17.0, 6.0)).goal == (17.0, 6.0)
    with pytest.raises(ManifestError, match=r"meadow, as a trial(.|\n)*lies outside"):
        trial_scenario(meadow, TrialSettings(), (170.0, 6.0))


def test_sensors_can_be_slower_in_trials_but_have_to_fit(lane_of: Any) -> None:
    lane: Field = lane_of(sensor_rate=2.5, time_limit_s=7.0)
    scenario = lane.scenario
    assert (scenario.camera.rate, scenario.lidar.rate, scenario.duration_s) == (2.5, 2.5, 7.0)
    with pytest.raises(ManifestError, match="lane, as a trial"):
        lane_of(sensor_rate=3.0)


def test_a_control_period_between_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="no whole number of the simulation's steps"):
        TrialSettings(control_period_s=0.125)
