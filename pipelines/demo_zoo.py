"""The demo's models: GrASPE and its ablation without reliability, trained briefly and compared."""

from __future__ import annotations

from pathlib import Path

from graspe_data.shards import Dataset
from model_zoo.training.machine import Machine
from model_zoo.training.recipe import load_recipe
from pipelines.zoo import Zoo, ZooProgress, plan_runs, run_zoo

MODELS = ("graspe", "graspe_no_reliability")
PRESET, RECIPE, FOLDER = "small", "demo", "zoo"


def run_demo_zoo(out: Path, threads: int, progress: ZooProgress) -> Path:
    """Train, evaluate and compare below the demo's folder, in a folder of its dataset.

    What is finished stays.

    Args:
        out: The demo's folder, with its dataset.
        threads: Of torch.
        progress: Who is told.

    Returns:
        The comparison, a Markdown file.

    Raises:
        ZooError: A model does not fit the dataset.
    """
    dataset = out / "dataset"
    folder = out / FOLDER / Dataset(dataset, "train", ()).digest[:12]
    machine = Machine(threads=threads, tensorboard=False)
    zoo = Zoo(dataset, load_recipe(RECIPE), folder, machine=machine)
    return run_zoo(zoo, plan_runs(MODELS, PRESET, 1), progress)
