"""What a stage is: a name, a version, the parameters that make its key, and the work."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.columns import Column
from graspe_data.observation.catalogue import StageName
from graspe_data.observation.labels import Annotation
from graspe_data.whole_folder import whole_folder
from pipelines.dataset_settings import DatasetRecipe
from pipelines.extract_record import ExtractRecord
from pipelines.row_columns import stage_columns
from pipelines.stage_record import StageRecord, read_record, stage_key, write_record


@dataclass(frozen=True)
class Work:
    """What the stages of one recording are given.

    Attributes:
        path: The recording.
        digest: Of its bytes.
        recipe: The dataset's and the robot's manifests, as they hold for this recording.
        annotation: What people said of it; None where there is no labels file.
        only: Stamps of the anchors to make rows of, int64 ns; None for all.
        extracted: What the stage ``extract`` left; None before it is done.
        episode: The folder of the stage ``extract``.
    """

    path: Path
    digest: str
    recipe: DatasetRecipe
    annotation: Annotation | None = None
    only: NDArray[np.int64] | None = None
    extracted: ExtractRecord | None = None
    episode: Path = Path()

    @property
    def rows(self) -> ExtractRecord:
        """The record of the stage ``extract``, on which the others stand."""
        if self.extracted is None:
            raise TypeError("the stage extract comes first")
        return self.extracted

    def columns(self, stage: StageName) -> list[Column]:
        """The columns that a stage writes."""
        return stage_columns(self.recipe, stage)


def always(recipe: DatasetRecipe) -> bool:
    """For stages that every dataset has."""
    del recipe
    return True


@dataclass(frozen=True)
class Stage:
    """One stage of a recording.

    Attributes:
        name: As columns and folders name it.
        version: Raised where the same parameters give other bytes.
        record: The model of what it leaves beside its columns.
        parameters: All that can change a byte, beside the version.
        make: Writes the columns into an empty folder and returns the record with the given key.
        wanted: Whether a dataset has it.
    """

    name: StageName
    version: int
    record: type[StageRecord]
    parameters: Callable[[Work], Mapping[str, Any]]
    make: Callable[[Work, Path, str], StageRecord]
    wanted: Callable[[DatasetRecipe], bool] = always

    def key(self, work: Work) -> str:
        """The digest of name, version and parameters."""
        return stage_key(self.name, self.version, **self.parameters(work))

    def run(self, work: Work, folder: Path, key: str | None = None) -> StageRecord:
        """Do the work in an empty folder; the record comes last."""
        record = self.make(work, folder, self.key(work) if key is None else key)
        write_record(folder, record)
        return record

    def run_once(self, work: Work, folder_of: Callable[[str], Path]) -> tuple[StageRecord, bool]:
        """What was done before under the same key, or do it; and whether it was done now."""
        key = self.key(work)
        folder = folder_of(key)
        done = read_record(folder, self.record, key)
        if done is not None:
            return done, False
        with whole_folder(folder) as partial:
            return self.run(work, partial, key), True


def after(work: Work, record: StageRecord, folder: Path) -> Work:
    """The work for the stages that come after one."""
    if isinstance(record, ExtractRecord):
        return replace(work, extracted=record, episode=folder)
    return work
