"""The optional column `intensity_map`, from recording to report."""

from __future__ import annotations

import base64
from pathlib import Path

import cv2
import numpy as np

from graspe_data.observation.intensity_map import GridSettings, LayerSettings
from graspe_data.progress import Silent
from graspe_data.shards import Dataset
from graspe_data.shards.dataset_index import read_index
from pipelines.build import build_dataset
from pipelines.dataset_settings import DatasetRecipe, SplitSettings, StorageSettings
from pipelines.executors import Workers
from pipelines.process_recording import RecordingTask, Refusal, process_recording
from pipelines.rederive import rederive_rows
from pipelines.report import page
from pipelines.stages.extract import EXTRACT
from pipelines.stages.stage import Work
from tests.pipelines.conftest import RecordingFactory

COARSE = LayerSettings(grid=GridSettings(cells=50, cell_m=0.2))


def asking(recipe: DatasetRecipe, layers: LayerSettings = COARSE) -> DatasetRecipe:
    """The recipe with the column, all rows in one split."""
    values = {
        "storage": StorageSettings(rows_per_shard=8, optional_columns=("intensity_map",)),
        "split": SplitSettings(train=1, validation=0, test=0),
        "intensity_map": layers,
    }
    return recipe.model_copy(update={"dataset": recipe.dataset.model_copy(update=values)})


def test_the_column_is_as_declared_proved_and_in_the_report(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    recording, folder = record(), tmp_path / "dataset"
    build_dataset(asking(recipe), [recording], folder, Workers(), Silent())
    index = read_index(folder)
    column = next(column for column in index.columns if column.name == "intensity_map")
    assert (column.dtype, column.shape, column.stage) == ("uint8", (3, 50, 50), "extract")
    dataset = Dataset(folder, "train")
    rows = dataset.batch(np.arange(len(dataset)))
    assert rows["intensity_map"].dtype == np.uint8
    assert rows["intensity_map"][rows["points_valid"].astype(bool)].any(axis=(1, 2, 3)).all()
    assert rederive_rows(folder, [recording], 3, 0).faults == ()
    shown = page._sample(index, dataset, "train", 0)["intensity"].partition("base64,")[2]
    png = np.frombuffer(base64.b64decode(shown), np.uint8)
    picture = cv2.imdecode(png, cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape == (340, 1360, 3)


def test_without_it_nothing_of_the_map_is_stored_nor_decides_a_digest(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    layers = {"intensity_map": COARSE}
    other = recipe.model_copy(update={"dataset": recipe.dataset.model_copy(update=layers)})
    recording = record()
    for name, chosen in (("a", recipe), ("b", other)):
        build_dataset(chosen, [recording], tmp_path / name, Workers(), Silent())
    indices = [read_index(tmp_path / name) for name in "ab"]
    assert indices[0].dataset_digest == indices[1].dataset_digest
    assert "intensity_map" not in {column.name for column in indices[0].columns}
    assert not list(tmp_path.glob("*/episodes/*/*/intensity_map.npy"))


def test_the_layers_are_part_of_the_key_where_the_column_is_asked_for(
    recipe: DatasetRecipe,
) -> None:
    keys = {
        EXTRACT.key(Work(Path("x"), "x", chosen))
        for chosen in (asking(recipe), asking(recipe, LayerSettings()), recipe)
    }
    assert len(keys) == 3


def test_clouds_on_another_scale_make_no_row_and_the_summary_names_the_key(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    moment = asking(recipe)
    lidar = moment.robot.lidar.model_copy(update={"intensity_maximum": 65535.0})
    wrong = moment.model_copy(update={"robot": moment.robot.model_copy(update={"lidar": lidar})})
    episode = process_recording(RecordingTask(record(), wrong, tmp_path / "episodes"))
    assert not isinstance(episode, Refusal)
    assert episode.extracted.rows == 0
    assert episode.extracted.lost["cloud cannot be observed"] > 0
    assert any("lidar.intensity_maximum" in loss.reason for loss in episode.extracted.losses)
