"""Turn evaluations into tables and plots; nothing is trained or predicted."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from graspe_data.atomic_file import write_atomically
from graspe_data.errors import ZooError
from model_zoo.evaluation.comparison_csv import render_csv
from model_zoo.evaluation.comparison_table import render_markdown
from model_zoo.evaluation.contestants import contestants
from model_zoo.evaluation.evaluation import Evaluation
from model_zoo.evaluation.plots import plot_calibration, plot_conditions, plot_roc
from model_zoo.evaluation.zoo_index import INDEX_NAME, index_of, render_index


def compare(evaluations: Sequence[Evaluation], out: Path) -> Path:
    """Write ``comparison.md``, ``comparison.csv``, ``zoo.yaml`` and the plots, each atomically.

    Args:
        evaluations: Of the same rows; several of one model and preset (other seeds) are averaged.
            Differences are to the first.
        out: Folder, made if it is not there.

    Returns:
        The path of ``comparison.md``.

    Raises:
        ZooError: The evaluations cannot be compared, or the folder cannot be written.
    """
    models = contestants(evaluations)
    plots = {"roc.png": plot_roc(models), "calibration.png": plot_calibration(models)}
    if len(evaluations[0].conditions) > 1:
        plots["conditions.png"] = plot_conditions(models)
    files = plots | {
        "comparison.csv": render_csv(models).encode(),
        "comparison.md": render_markdown(models, list(plots)).encode(),
        INDEX_NAME: render_index(index_of(evaluations)).encode(),
    }
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ZooError(f"{out}: cannot be made: {error.strerror}.") from error
    for name, content in files.items():
        write_atomically(out / name, [content], ZooError)
    return out / "comparison.md"
