"""Small recordings and a manifest for them."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from graspe_data.observation.settings import HorizonSettings, ImageSettings, PointSettings
from graspe_data.recordings.writing import Container
from graspe_data.robot import Mounting
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.recording import record_drive
from graspe_data.synchronisation.row_plan import WindowSettings
from pipelines.dataset_settings import DatasetManifest, DatasetRecipe, StorageSettings, load_recipe
from tests.conftest import GardenDrive

LEGS = (Leg(2.5, 0.6, 0.0), Leg(1.5, 0.5, 0.3), Leg(1.5, 0.5, 0.0), Leg(1.0, -0.4, 0.0))
"""Into the bush, and out of it backwards."""
SUFFIX = {"bag": ".bag", "db3": "", "mcap": ""}


class RecordingStore:
    """Records each drive once for all tests."""

    def __init__(self, folder: Path, drive: GardenDrive) -> None:
        self._folder, self._drive = folder, drive
        self._known: dict[tuple[object, ...], Path] = {}

    def fetch(self, name: str, container: Container, seed: int, legs: tuple[Leg, ...]) -> Path:
        key = (name, container, seed, legs)
        if key not in self._known:
            folder = self._folder / str(len(self._known))
            folder.mkdir()
            record_drive(self._drive(legs, seed), folder / name, container)
            self._known[key] = folder / name
        return self._known[key]


class RecordingFactory:
    """Puts small recordings into a folder."""

    def __init__(self, folder: Path, store: RecordingStore) -> None:
        self.folder, self._store = folder, store
        folder.mkdir()

    def __call__(
        self,
        name: str = "drive",
        container: Container = "mcap",
        seed: int = 0,
        legs: tuple[Leg, ...] = LEGS,
    ) -> Path:
        stored = self._store.fetch(f"{name}{SUFFIX[container]}", container, seed, legs)
        copy = shutil.copytree if stored.is_dir() else shutil.copy
        copy(stored, self.folder / stored.name)
        return self.folder / stored.name


@pytest.fixture(scope="session")
def recording_store(
    tmp_path_factory: pytest.TempPathFactory, garden_drive: GardenDrive
) -> RecordingStore:
    return RecordingStore(tmp_path_factory.mktemp("recording_store"), garden_drive)


@pytest.fixture
def record(tmp_path: Path, recording_store: RecordingStore) -> RecordingFactory:
    return RecordingFactory(tmp_path / "recordings", recording_store)


@pytest.fixture
def recipe() -> DatasetRecipe:
    defaults = PointSettings()
    dataset = DatasetManifest(
        name="small",
        robot="spot",
        window=WindowSettings(anchor_rate=5, history_steps=10),
        horizon=HorizonSettings(steps=5, step_s=0.2),
        image=ImageSettings(width=80, height=60),
        points=defaults.model_copy(
            update={"sample": defaults.sample.model_copy(update={"count": 500})}
        ),
        storage=StorageSettings(rows_per_shard=8),
    )
    robot = load_recipe("field").robot
    looking_down = Mounting(
        translation=(0.4, 0, 0.25), rotation_rpy=(-np.pi / 2 - 1.2, 0, -np.pi / 2)
    )
    camera = robot.camera.model_copy(update={"mounting": looking_down})
    return DatasetRecipe(dataset=dataset, robot=robot.model_copy(update={"camera": camera}))
