from __future__ import annotations

from pathlib import Path

import pytest

from model_zoo.export import export_bundle
from tests.model_zoo.export.made import Made, write_dataset, write_made

QUICK = "paad"
"""The model that is exported fastest."""


@pytest.fixture(scope="session")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """A dataset, a checkpoint trained on it, and its bundle."""
    folder = tmp_path_factory.mktemp("quick")
    index = write_dataset(folder / "dataset")
    checkpoint = write_made(folder / "checkpoint", QUICK, index)
    bundle = export_bundle(checkpoint, folder / "bundle", folder / "dataset")
    return Made(QUICK, folder / "dataset", index, checkpoint, bundle)


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    write_dataset(tmp_path / "dataset")
    return tmp_path / "dataset"
