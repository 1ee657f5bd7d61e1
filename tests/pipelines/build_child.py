"""A child process that builds a dataset, to be killed.

Arguments: the recipe's JSON, the dataset's folder, how many workers, the recordings.
Writes a line when the build begins, and one when it is done.
"""

from __future__ import annotations

import sys
from pathlib import Path

from graspe_data.progress import Silent
from pipelines.build import build_dataset
from pipelines.dataset_settings import DatasetRecipe
from pipelines.executors import Workers


def main(recipe: Path, out: Path, workers: int, recordings: list[Path]) -> None:
    """Build."""
    loaded = DatasetRecipe.model_validate_json(recipe.read_bytes())
    sys.stdout.write("begins\n")
    sys.stdout.flush()
    build_dataset(loaded, recordings, out, Workers(workers), Silent())
    sys.stdout.write("done\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), [Path(p) for p in sys.argv[4:]])
