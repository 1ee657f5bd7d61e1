"""Small recordings and a manifest for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from graspe_data.recordings.writing import Container
from graspe_data.robot import Mounting
from graspe_data.simulation.plain_world import Block, Trunk, World
from graspe_data.simulation.scripted_drive import Leg, drive
from graspe_data.simulation.scripted_recording import Sensors, record_drive
from pipelines.dataset_settings import (
    DatasetManifest,
    DatasetRecipe,
    HorizonSettings,
    ImageSettings,
    PointSettings,
    StorageSettings,
    WindowSettings,
    load_recipe,
)

WORLD = World(trunks=(Trunk(4, 1, 0.2, 4),), blocks=(Block((8, 9), (-3, 3), 2.0),))
SENSORS = Sensors(camera_rate=5, lidar_rate=5, width=160, height=120)
LEGS = (Leg(2.5, 0.6, 0.0), Leg(1.5, 0.5, 0.3), Leg(1.5, 0.5, 0.0, "stuck"), Leg(1.0, 0.4, 0.0))
SUFFIX = {"bag": ".bag", "db3": "", "mcap": ""}


class RecordingFactory:
    """Writes small recordings into a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()

    def __call__(
        self,
        name: str = "drive",
        container: Container = "mcap",
        seed: int = 0,
        legs: tuple[Leg, ...] = LEGS,
    ) -> Path:
        path = self.folder / f"{name}{SUFFIX[container]}"
        record_drive(path, container, WORLD, drive(legs), SENSORS, seed)
        return path


@pytest.fixture
def record(tmp_path: Path) -> RecordingFactory:
    return RecordingFactory(tmp_path / "recordings")


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
    robot = load_recipe("demo").robot
    looking_down = Mounting(
        translation=(0.4, 0, 0.25), rotation_rpy=(-np.pi / 2 - 1.2, 0, -np.pi / 2)
    )
    camera = robot.camera.model_copy(update={"mounting": looking_down})
    return DatasetRecipe(dataset=dataset, robot=robot.model_copy(update={"camera": camera}))
