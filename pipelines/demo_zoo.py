"""The demo's models: GrASPE and an ablation, trained briefly, compared, and one put to use."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from graspe_data.shards import Dataset
from model_zoo.export import export_bundle
from model_zoo.training.machine import Machine
from model_zoo.training.recipe import load_recipe
from pipelines.candidates import columns_of, most_telling, write_candidates_picture
from pipelines.zoo import Zoo, ZooProgress, plan_runs, run_zoo
from planners.bundle import load_bundle

MODELS = ("graspe", "graspe_no_reliability")
PRESET, RECIPE, FOLDER = "small", "demo", "zoo"
BUNDLE, PICTURE = "bundle", "candidates.png"


@dataclass(frozen=True)
class DemoModels:
    """What the models' part of the demo wrote.

    Attributes:
        comparison: The comparison, a Markdown file.
        bundle: GrASPE as planners load it.
        candidates: A picture of one scene with its scored candidates.
    """

    comparison: Path
    bundle: Path
    candidates: Path


def run_demo_zoo(out: Path, threads: int, progress: ZooProgress) -> DemoModels:
    """Train, evaluate and compare below the demo's folder, in a folder of its dataset.

    The first model becomes a bundle, which is asked about candidates in a scene of the test split.

    What is finished stays.

    Args:
        out: The demo's folder, with its dataset.
        threads: Of torch.
        progress: Who is told.

    Raises:
        ZooError: A model does not fit the dataset, or its bundle does not do as it does.
    """
    dataset = out / "dataset"
    folder = out / FOLDER / Dataset(dataset, "train", ()).digest[:12]
    machine = Machine(threads=threads, tensorboard=False)
    zoo = Zoo(dataset, load_recipe(RECIPE), folder, machine=machine)
    runs = plan_runs(MODELS, PRESET, 1)
    comparison = run_zoo(zoo, runs, progress)
    bundle = _exported(folder / runs[0].name / "checkpoint", folder / BUNDLE, dataset, progress)
    return DemoModels(comparison, bundle, _candidates(bundle, dataset, folder / PICTURE, threads))


def _exported(checkpoint: Path, bundle: Path, dataset: Path, progress: ZooProgress) -> Path:
    if bundle.is_dir():
        return bundle
    with progress.evaluation() as evaluation:
        return export_bundle(checkpoint, bundle, dataset, evaluation)


def _candidates(bundle: Path, dataset: Path, picture: Path, threads: int) -> Path:
    loaded = load_bundle(bundle, threads)
    rows = Dataset(dataset, "test", columns_of(loaded))
    write_candidates_picture(most_telling(loaded, rows), picture)
    return picture
