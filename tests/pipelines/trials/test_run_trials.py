"""Many trials: files that stay, methods by name and by bundle, bags beside them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.bundle_contract import BundleContract
from graspe_data.calibration import Calibration
from graspe_data.errors import PlannerError, StageError
from graspe_data.progress import Silent
from graspe_data.recordings import open_recording
from graspe_data.robot import Limits
from graspe_data.simulation.recorded_truth import read_truth
from pipelines.executors import Workers
from pipelines.trials.config import Conditions, TrialConfig
from pipelines.trials.methods import Method, make_planner, make_witness, parse_methods
from pipelines.trials.run_trial import run_trial
from pipelines.trials.run_trials import TrialTask, run_trials
from pipelines.trials.seeds import fair_seeds
from pipelines.trials.settings import TrialSettings
from pipelines.trials.trial import Trial, read_trial
from tests.planners.tiny_bundle import tiny_contract, write_tiny_bundle

ContractOf = Callable[..., BundleContract]

FOX, LAB = Method("dwa_fox"), Method("dwa_lab")
BRIEF = TrialConfig(trial=TrialSettings(time_limit_s=1.5, control_period_s=0.2))


@pytest.fixture(scope="module")
def conditions(lane_of: Any, bush: dict[str, Any]) -> Conditions:
    lane = lane_of(bush, time_limit_s=1.5)
    return Conditions(scenario=lane.scenario, robot=lane.robot, trial=BRIEF.trial)


@pytest.fixture(scope="module")
def contract(lane_of: Any) -> ContractOf:
    """Contracts for the robot of the lane."""
    lane = lane_of()
    calibration = Calibration(
        lane.camera.intrinsics, lane.camera.base_from_camera, lane.lidar.base_from_lidar
    )
    return partial(tiny_contract, lane.robot, calibration)


@pytest.fixture(scope="module")
def tiny(contract: ContractOf, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tiny_bundle(tmp_path_factory.mktemp("bundles") / "tiny", contract())


def run(out: Path, conditions: Conditions, *methods: Method, **changes: Any) -> list[Trial]:
    options: dict[str, Any] = {"config": BRIEF, "seeds": (0,)} | changes
    config, seeds = options.pop("config"), options.pop("seeds")
    tasks = [TrialTask(conditions, s, m, config, **options) for s in seeds for m in methods]
    return run_trials(tasks, out, Workers(), Silent())


def written(out: Path) -> dict[str, int]:
    return {str(path.relative_to(out)): path.stat().st_mtime_ns for path in out.rglob("*.json")}


def test_each_trial_has_its_file_and_the_scenario_its_conditions(
    conditions: Conditions, tmp_path: Path
) -> None:
    done = run(tmp_path, conditions, FOX, LAB, seeds=(0, 3))
    assert set(written(tmp_path)) == {
        "lane/conditions.json",
        *(f"lane/{method}/{seed}.json" for method in ("dwa_fox", "dwa_lab") for seed in (0, 3)),
    }
    assert [(trial.seed, trial.method) for trial in done] == [
        (seed, method) for seed in (0, 3) for method in ("dwa_fox", "dwa_lab")
    ]
    assert read_trial(tmp_path / "lane/dwa_lab/3.json") == done[3]
    text = (tmp_path / "lane/conditions.json").read_text()
    assert Conditions.model_validate_json(text) == conditions
    assert {trial.conditions for trial in done} == {conditions.digest}


def test_what_is_there_stays_and_what_is_damaged_or_changed_is_run_again(
    conditions: Conditions, tmp_path: Path
) -> None:
    first = run(tmp_path, conditions, FOX, LAB)
    before = written(tmp_path)["lane/dwa_fox/0.json"]
    assert run(tmp_path, conditions, FOX, LAB)[0] == first[0]
    assert written(tmp_path)["lane/dwa_fox/0.json"] == before
    (tmp_path / "lane/dwa_fox/0.json").write_text("{")
    assert run(tmp_path, conditions, FOX)[0].path == first[0].path
    slimmer = BRIEF.dwa_lab.model_copy(update={"radius": 0.4})
    other = BRIEF.model_copy(update={"dwa_lab": slimmer})
    kept, changed = run(tmp_path, conditions, FOX, LAB, config=other)
    assert kept.inputs == first[0].inputs
    assert changed.inputs != first[1].inputs


def test_the_number_of_workers_changes_nothing_but_times(
    conditions: Conditions, tmp_path: Path
) -> None:
    tasks = [TrialTask(conditions, seed, FOX, BRIEF) for seed in (0, 1)]
    trials = []
    for workers in (1, 2):
        done = run_trials(tasks, tmp_path / str(workers), Workers(workers), Silent())
        trials.append([trial.model_dump(exclude={"control"}) for trial in done])
    assert trials[0] == trials[1]


def test_a_bundle_drives_and_is_part_of_what_a_trial_depends_on(
    conditions: Conditions, tiny: Path, contract: ContractOf, tmp_path: Path
) -> None:
    (trial,) = run(tmp_path, conditions, Method("ours", tiny))
    assert trial.control.answers == 7
    assert trial.method == "ours"
    assert not any("stop:" in reason for reason in trial.safe_commands)
    other = write_tiny_bundle(tmp_path / "other", contract(uses_candidates=False))
    inputs = [Method("ours", folder).inputs("c", 0, BRIEF) for folder in (tiny, tiny, other)]
    assert inputs[0] == inputs[1] != inputs[2]


@pytest.mark.parametrize("name", ["mim", "mim_printed", "mim_uniform", "dwa_map", "glass_slam"])
def test_a_method_with_a_map_tells_how_right_its_maps_were(
    name: str, conditions: Conditions, tmp_path: Path
) -> None:
    (trial,) = run(tmp_path, conditions, Method(name))
    assert trial.maps is not None
    assert trial.maps.maps == 2
    assert 0 <= trial.maps.right <= trial.maps.called
    assert trial.maps.there > 0
    assert not any("stop:" in reason for reason in trial.safe_commands)
    assert read_trial(tmp_path / f"lane/{name}/0.json") == trial


def test_settings_of_maps_count_for_the_methods_that_have_them() -> None:
    form = {"intensity": {"planning": {"classes": {"threshold": 0.5}}}}
    other = TrialConfig.model_validate({"trial": BRIEF.trial, "maps": form})
    names = ("dwa_fox", "dwa_lab", "mim", "mim_printed", "mim_uniform", "dwa_map", "glass_slam")
    changed = [
        Method(name).inputs("c", 0, BRIEF) != Method(name).inputs("c", 0, other) for name in names
    ]
    assert changed == [False, False, True, False, True, False, False]


def test_a_bundle_called_truth_asks_the_world(lane_of: Any, tiny: Path) -> None:
    field = lane_of({"kind": "wall", "lines": [[[-1.6, -2.0], [-1.6, 2.0]]]}, time_limit_s=1.5)
    witness = make_witness(Method("truth", tiny), field)
    assert witness is not None
    assert make_witness(Method("tiny", tiny), field) is None
    planner = make_planner(Method("truth", tiny), field, BRIEF, 1, witness=witness)
    run = run_trial(field, planner, BRIEF.trial, Method("truth", tiny).senses, witness)
    for entry in run.logbook.entries:
        scored = entry.scored
        assert scored is not None
        assert scored.success is not None
        through = run.logbook.free_candidates(entry, scored.velocities)
        np.testing.assert_array_equal(scored.success.min(axis=1), through)
        assert 0 < through.mean() < 1


def test_a_bundle_of_another_robot_is_refused(
    conditions: Conditions, tiny: Path, lane_of: Any
) -> None:
    lane = lane_of()
    limits = Limits(linear_velocity=(0.0, 2.0), yaw_rate=(-0.6, 0.6))
    faster = lane.robot.model_copy(update={"limits": limits})
    field = type(lane)(**(vars(lane) | {"robot": faster}))
    with pytest.raises(PlannerError, match="linear_velocity"):
        make_planner(Method("ours", tiny), field, BRIEF, 1)


def test_a_recorded_trial_has_its_bag_beside_with_the_truth(
    conditions: Conditions, tmp_path: Path
) -> None:
    (trial,) = run(tmp_path, conditions, FOX, record=True)
    bag = tmp_path / "lane/dwa_fox/0.bag"
    with open_recording(bag) as recording:
        assert {"/camera/color/image_raw/compressed", "/velodyne_points"} <= set(recording.topics)
        assert recording.topics["/cmd_vel"].count == round(trial.duration_s * 10)
    assert len(read_truth(bag).stamps_ns) == round(trial.duration_s * 5 + 0.49)
    assert {path.name for path in bag.parent.iterdir()} == {
        "0.json",
        "0.bag",
        "0.bag.truth.yaml",
    }


def test_recording_later_runs_the_trial_again(conditions: Conditions, tmp_path: Path) -> None:
    first = run(tmp_path, conditions, LAB)[0]
    assert run(tmp_path, conditions, LAB, record=True)[0].path == first.path
    assert (tmp_path / "lane/dwa_lab/0.bag").is_file()


def test_methods_are_planners_bundles_and_folders_of_bundles(tiny: Path, tmp_path: Path) -> None:
    moment = ["dwa_fox", f"ours={tiny}"]
    assert parse_methods(moment) == [FOX, Method("ours", tiny.resolve())]
    assert parse_methods([str(tiny)]) == [Method("tiny", tiny.resolve())]
    assert parse_methods([str(tiny.parent)]) == [Method("tiny", tiny.resolve())]


@pytest.mark.parametrize(
    "moment", ["dwa", "ours=nowhere", "dwa_fox={tiny}", "a b={tiny}", "{empty}"]
)
def test_what_is_no_method_is_refused(moment: str, tiny: Path, tmp_path: Path) -> None:
    text = moment.format(tiny=tiny, empty=tmp_path)
    with pytest.raises(StageError, match=r"expected dwa_fox, dwa_lab, mim, .*, NAME=BUNDLE"):
        parse_methods([text])


def test_two_methods_of_one_name_are_refused(tiny: Path) -> None:
    with pytest.raises(StageError, match="tiny is named more than once"):
        parse_methods([str(tiny), f"tiny={tiny}"])


def test_seeds_with_something_at_the_goal_are_left_out(
    conditions: Conditions, lane_of: Any
) -> None:
    assert fair_seeds(conditions, 5, 3) == [5, 6, 7]
    scattered = {"kind": "pillar", "per_100_m2": [6.0, 6.0], "intertwined": True}
    crowded = lane_of(scattered).scenario
    there = Conditions(scenario=crowded, robot=conditions.robot, trial=BRIEF.trial)
    chosen = fair_seeds(there, 0, 5)
    assert chosen != [0, 1, 2, 3, 4]
    assert chosen == sorted(set(chosen))


def test_a_goal_that_is_always_barred_is_refused(conditions: Conditions, lane_of: Any) -> None:
    barred = lane_of({"kind": "pillar", "at": [[3.2, 0.0]]}).scenario
    there = Conditions(scenario=barred, robot=conditions.robot, trial=BRIEF.trial)
    with pytest.raises(StageError, match=r"something stands at the goal \(3, 0\)"):
        fair_seeds(there, 0, 1)
