"""One recording through all its stages; what is done already is not done again."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from graspe_data.errors import GraspeError
from graspe_data.recordings import recording_digest
from graspe_data.recordings.layout import storage_files
from pipelines.dataset_settings import DatasetRecipe
from pipelines.extract_record import ExtractRecord
from pipelines.stage_record import StageRecord, stage_folder
from pipelines.stages.label import LabelRecord, find_annotation
from pipelines.stages.sequence import STAGES
from pipelines.stages.stage import Work, after


@dataclass(frozen=True)
class RecordingTask:
    """A recording to process: where it is, how, and where episodes are kept."""

    path: Path
    recipe: DatasetRecipe
    episodes: Path


@dataclass(frozen=True)
class Episode:
    """A recording's finished stages and their folders, by stage name."""

    path: Path
    digest: str
    extracted: ExtractRecord
    records: dict[str, StageRecord]
    folders: dict[str, Path]
    done_now: tuple[str, ...]
    """The stages that this run had to do."""
    files: tuple[str, ...] = ()
    """The names of its files, parts of one recording perhaps."""

    @property
    def labelled(self) -> LabelRecord:
        """What the stage ``label`` left."""
        record = self.records["label"]
        if not isinstance(record, LabelRecord):
            raise TypeError(type(record))
        return record


@dataclass(frozen=True)
class Refusal:
    """A recording of which no episode was made, and why, in words for its owner."""

    path: Path
    digest: str
    reason: str
    counted_as: str = ""
    """The name of the recording of the same drive that counts in its place."""


def process_recording(task: RecordingTask) -> Episode | Refusal:
    """Run the stages of one recording; a fault of the recording is an answer, not an exception."""
    digest = ""
    try:
        digest = recording_digest(task.path)
        return _stages(task, digest)
    except GraspeError as error:
        text = str(error)
        named = text if task.path.name in text else f"{task.path.name}: {text}"
        return Refusal(task.path, digest, named)
    except OSError as error:
        return Refusal(task.path, digest, f"{task.path}: {error.strerror or error}.")


def _stages(task: RecordingTask, digest: str) -> Episode:
    recipe = task.recipe.for_recording(task.path.name)
    home = task.episodes / digest[:16]
    work = Work(task.path, digest, recipe, find_annotation(task.path, digest))
    records: dict[str, StageRecord] = {}
    folders: dict[str, Path] = {}
    done_now: list[str] = []
    for stage in STAGES:
        if not stage.wanted(recipe):
            continue
        record, is_new = stage.run_once(work, partial(stage_folder, home, stage.name))
        records[stage.name] = record
        folders[stage.name] = stage_folder(home, stage.name, record.key)
        done_now += [stage.name] if is_new else []
        work = after(work, record, folders[stage.name])
    files = tuple(file.name for file in storage_files(task.path))
    return Episode(task.path, digest, work.rows, records, folders, tuple(done_now), files)
