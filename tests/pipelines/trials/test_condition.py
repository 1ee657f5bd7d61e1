"""Sensors that fail in mid-drive: the same worlds and noise, each condition a table's column."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import ManifestError
from graspe_data.manifest import shipped_manifests
from graspe_data.progress import Silent
from graspe_data.simulation.field import build_field, scenario_world
from pipelines.executors import Workers
from pipelines.trials.condition import SensorCondition, load_condition, under
from pipelines.trials.config import Conditions, TrialConfig
from pipelines.trials.methods import Method
from pipelines.trials.results import cells, read_trials
from pipelines.trials.run_trials import TrialTask, run_trials
from pipelines.trials.settings import TrialSettings

SHIPPED = sorted(path.stem for path in (shipped_manifests() / "conditions").glob("*.yaml"))
BRIEF = TrialConfig(trial=TrialSettings(time_limit_s=1.5, control_period_s=0.2))
AT_ONCE = SensorCondition.model_validate(
    {
        "name": "all_hidden",
        "occlusions": [
            {"kind": "lidar", "width": [6.2, 6.2], "every_s": [0, 0], "lasting_s": [99, 99]}
        ],
    }
)


@pytest.fixture(scope="module")
def lane(lane_of: Any, bush: dict[str, Any]) -> Conditions:
    field = lane_of(bush, time_limit_s=1.5)
    return Conditions(scenario=field.scenario, robot=field.robot, trial=BRIEF.trial)


def test_those_of_the_study_ship() -> None:
    assert {"lens_covered", "glare", "lidar_sector_lost", "dust"} <= {*SHIPPED}


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_one_begins_in_mid_drive_and_stays(name: str, lane: Conditions) -> None:
    condition = load_condition(name)
    assert condition.name == name
    longer = lane.scenario.model_copy(update={"duration_s": 60.0})
    for seed in range(4):
        covers = build_field(under(longer, condition), lane.robot, seed, threads=1).covers
        spells = [(start, stop) for start, stop, _ in (*covers.lens, *covers.lidar)]
        ((start, stop),) = (*spells, *covers.frozen)
        assert 3 <= start <= 8
        assert stop > 60


def test_worlds_and_own_covers_are_those_without_it(lane: Conditions) -> None:
    own = {"kind": "lens", "share": [0.3, 0.9], "every_s": [1, 5], "lasting_s": [1, 2]}
    covered = lane.scenario.model_validate(
        lane.scenario.model_dump() | {"occlusions": [own], "duration_s": 60.0}
    )
    glare = under(covered, load_condition("glare"))
    assert scenario_world(glare, 5).start == scenario_world(covered, 5).start
    plain, ailing = (build_field(s, lane.robot, 5, threads=1) for s in (covered, glare))
    assert ailing.covers.lens[: len(plain.covers.lens)] == plain.covers.lens
    np.testing.assert_array_equal(
        ailing.world.obstacles.start, plain.world.obstacles.start, strict=True
    )


def test_each_condition_has_its_files_and_its_column(lane: Conditions, tmp_path: Path) -> None:
    hidden = lane.model_copy(
        update={"scenario": under(lane.scenario, AT_ONCE), "condition": AT_ONCE.name}
    )
    tasks = [TrialTask(each, 0, Method("dwa_fox"), BRIEF) for each in (lane, hidden)]
    sound, blind = run_trials(tasks, tmp_path, Workers(), Silent())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lane", "lane+all_hidden"]
    assert (sound.scenario, blind.scenario) == ("lane", "lane+all_hidden")
    assert sound.inputs != blind.inputs
    assert blind.safe_commands
    assert blind.path_m < sound.path_m
    counted = cells(read_trials(tmp_path), ())
    assert {cell.scenario for cell in counted} == {"lane", "lane+all_hidden"}


def test_without_one_the_digest_is_that_of_before(lane: Conditions) -> None:
    assert lane.label == "lane"
    assert lane.model_copy(update={"condition": "named"}).digest == lane.digest


def test_an_unknown_one_is_refused_with_the_nearest() -> None:
    with pytest.raises(ManifestError, match="Did you mean 'glare'"):
        load_condition("glares")
