"""The models that ship, asked about a drive through a world that they have not seen."""

from __future__ import annotations

from pathlib import Path

from graspe_data.progress import Silent
from graspe_data.simulation.scenario import load_scenario
from model_zoo.checkpoints import load_checkpoint
from model_zoo.evaluation import evaluate
from pipelines.build import build_dataset
from pipelines.dataset_settings import load_recipe
from pipelines.executors import Workers
from pipelines.simulate import Simulation, simulate

PRETRAINED = Path(__file__).parents[2] / "pretrained"
LEAST_AU_ROC = 0.8
"""A coin has 0.5; on this drive, in which the robot is stuck twice, the five have 0.96 to 0.98."""


def test_every_shipped_model_tells_what_fails_in_a_world_of_the_test_scenarios(
    tmp_path: Path,
) -> None:
    scenario, robot = load_scenario("graspe_1_plants")
    drive = Simulation(scenario.model_copy(update={"duration_s": 40.0}), robot, 1, "bag", "none")
    (simulated,) = simulate([drive], tmp_path, Workers(), Silent(), replace=True)
    dataset = tmp_path / "dataset"
    build_dataset(load_recipe("field"), [simulated.path], dataset, Workers(), Silent())
    found = {}
    for folder in sorted(PRETRAINED.iterdir()):
        evaluation = evaluate(load_checkpoint(folder), dataset, conditions=("clean",), every=2)
        (whole,) = [cell for cell in evaluation.cells if cell.scenario == "all"]
        found[folder.name] = whole.scores["au_roc"].value
    assert len(found) == 5
    assert {name: area for name, area in found.items() if not area or area < LEAST_AU_ROC} == {}
