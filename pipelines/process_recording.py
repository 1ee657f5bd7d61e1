"""One recording through all its stages; what is done already is not done again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from graspe_data.errors import GraspeError
from graspe_data.recordings import recording_digest
from graspe_data.recordings.layout import storage_files
from graspe_data.whole_folder import whole_folder
from pipelines.dataset_settings import DatasetRecipe
from pipelines.stage import StageRecord, read_record, stage_folder
from pipelines.stages.candidates import candidates, candidates_key
from pipelines.stages.extract import ExtractRecord, extract, extract_key
from pipelines.stages.label import LabelRecord, find_annotation, label, label_key
from pipelines.stages.reliability import reliability, reliability_key
from pipelines.stages.trajectory import trajectory, trajectory_key

Record = TypeVar("Record", bound=StageRecord)


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
    labelled: LabelRecord
    records: dict[str, StageRecord]
    folders: dict[str, Path]
    done_now: tuple[str, ...]
    """The stages that this run had to do."""
    files: tuple[str, ...] = ()
    """The names of its files, parts of one recording perhaps."""


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
    dataset = recipe.dataset
    home = task.episodes / digest[:16]
    done_now: list[str] = []
    folders: dict[str, Path] = {}

    def run(stage: str, key: str, model: type[Record], work: Callable[[Path], Record]) -> Record:
        folder = folders[stage] = stage_folder(home, stage, key)
        record = read_record(folder, model, key)
        if record is None:
            with whole_folder(folder) as partial:
                record = work(partial)
            done_now.append(stage)
        return record

    extracted = run(
        "extract",
        extract_key(recipe, digest),
        ExtractRecord,
        lambda folder: extract(task.path, digest, recipe, folder),
    )
    episode = folders["extract"]
    reliable = run(
        "reliability",
        reliability_key(dataset, extracted),
        StageRecord,
        lambda folder: reliability(dataset, extracted, episode, folder),
    )
    drawn = run(
        "trajectory",
        trajectory_key(recipe, extracted),
        StageRecord,
        lambda folder: trajectory(recipe, extracted, episode, folder),
    )
    annotation = find_annotation(task.path, digest)
    labelled = run(
        "label",
        label_key(dataset, extracted, annotation),
        LabelRecord,
        lambda folder: label(dataset, extracted, annotation, episode, folder),
    )
    done: list[StageRecord] = [extracted, reliable, drawn, labelled]
    if (asked := dataset.candidates) is not None:
        answered = run(
            "candidates",
            candidates_key(recipe, asked, extracted),
            StageRecord,
            lambda folder: candidates(task.path, recipe, asked, extracted, episode, folder),
        )
        done.append(answered)
    records = {record.stage: record for record in done}
    files = tuple(file.name for file in storage_files(task.path))
    done_here = tuple(done_now)
    return Episode(task.path, digest, extracted, labelled, records, folders, done_here, files)
