"""The main job: recordings to a dataset."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from graspe_data.columns import Column
from graspe_data.errors import StageError
from graspe_data.progress import Progress
from graspe_data.shards.dataset_index import (
    DatasetIndex,
    RecordingEntry,
    ShardFile,
    write_index,
)
from pipelines.dataset_folder import EPISODES, earlier_shards, only_builder, prune
from pipelines.dataset_settings import DatasetRecipe, Split
from pipelines.executors import Workers, run_all
from pipelines.index import dataset_index, recording_entry, refused_entry
from pipelines.parts import Part, split_parts
from pipelines.process_recording import Episode, RecordingTask, Refusal, process_recording
from pipelines.row_columns import row_columns
from pipelines.same_drives import DriveIdentity
from pipelines.splits import SplitPlacement, place_recordings
from pipelines.stages.shard import EpisodeSource, ShardTask, make_shard, plan_shards

SPLITS: tuple[Split, ...] = ("train", "validation", "test")


@dataclass(frozen=True)
class BuildResult:
    """What a build did: the committed index, and which recordings had work done now."""

    index: DatasetIndex
    worked_on: tuple[str, ...]
    refused: tuple[Refusal, ...]


def build_dataset(
    recipe: DatasetRecipe,
    recordings: Sequence[Path],
    out: Path,
    workers: Workers,
    progress: Progress,
) -> BuildResult:
    """Build a dataset, or bring one up to date.

    Args:
        recipe: The dataset and robot manifests.
        recordings: The recordings, see ``find_recordings``.
        out: The dataset's folder.
        workers: Where the work is done; the bytes are the same wherever it is.
        progress: Is told of every finished recording and shard.

    Raises:
        StageError: No recording makes a row; or another build is at work in the folder.
        ShardError: The disk refuses.
    """
    with only_builder(out):
        outcomes = list(_process(recipe, recordings, out, workers, progress))
        episodes, refused = _sorted_out(recipe, outcomes)
        episodes, placements, conflicting = _placed(recipe, episodes)
        parts, uncut = split_parts(recipe.dataset, episodes, placements)
        refused += [*conflicting, *uncut]
        if not any(part.rows.size for part in parts):
            raise StageError(_no_rows(episodes, refused))
        entries = list(map(recording_entry, parts))
        entries += [refused_entry(recipe, refusal) for refusal in refused]
        columns = row_columns(recipe)
        tasks = _shard_tasks(recipe, columns, parts, entries, out)
        shards = _make_shards(tasks, earlier_shards(out), workers, progress)
        index = write_index(out, dataset_index(recipe, columns, entries, shards))
        prune(out, index, [episode.folders.values() for episode in episodes])
    worked_on = tuple(episode.path.name for episode in episodes if episode.done_now)
    return BuildResult(index, worked_on, tuple(refused))


def _process(
    recipe: DatasetRecipe,
    recordings: Sequence[Path],
    out: Path,
    workers: Workers,
    progress: Progress,
) -> Iterator[Episode | Refusal]:
    tasks = [
        RecordingTask(path.absolute(), recipe, (out / EPISODES).resolve()) for path in recordings
    ]
    progress.start("recordings", len(tasks))
    for task, outcome in run_all(workers, process_recording, tasks):
        outcome = outcome or Refusal(  # noqa: PLW2901
            task.path,
            "",
            f"{task.path.name}: its worker process ended (killed, or it could not start); try "
            f"--workers 1.",
        )
        progress.advance(_summary(outcome))
        yield outcome


def _summary(outcome: Episode | Refusal) -> str:
    if isinstance(outcome, Refusal):
        return f"{outcome.path.name}: refused: {outcome.reason}"
    record = outcome.extracted
    losses = "; ".join(f"{count} lost: {reason}" for reason, count in record.lost.items())
    state = "" if outcome.done_now else ", up to date"
    return f"{outcome.path.name}: {record.rows} rows{state}" + (f"; {losses}" if losses else "")


def _sorted_out(
    recipe: DatasetRecipe, outcomes: Iterable[Episode | Refusal]
) -> tuple[list[Episode], list[Refusal]]:
    """Episodes by digest and refusals by name; of the same drive given twice, one.

    The one that counts is in a declared group if any is, else has a labels file if any has.
    """
    ordered = sorted(outcomes, key=lambda outcome: (outcome.digest, outcome.path.name))
    refused = [outcome for outcome in ordered if isinstance(outcome, Refusal)]
    found = [outcome for outcome in ordered if isinstance(outcome, Episode)]
    split, known = recipe.dataset.split, dict[str, Episode]()
    for episode in sorted(
        found,
        key=lambda item: (split.group_of(item.path.name) is None, not item.labelled.annotated),
    ):
        first = known.setdefault(_drive(episode).identity, episode)
        if first is not episode:
            refused.append(_same(episode, first))
    kept = {id(episode) for episode in known.values()}
    return [episode for episode in found if id(episode) in kept], refused


def _same(episode: Episode, first: Episode) -> Refusal:
    name, other = episode.path.name, first.path.name
    same = f"the same recording as {other}; it counts once."
    if episode.digest != first.digest:
        same = f"the same drive as {other}, in another container; it counts once."
    return Refusal(episode.path, episode.digest, f"{name}: {same}", counted_as=other)


def _drive(episode: Episode) -> DriveIdentity:
    return DriveIdentity(
        episode.path.name, episode.digest, episode.extracted.content, episode.files
    )


def _placed(
    recipe: DatasetRecipe, episodes: Sequence[Episode]
) -> tuple[list[Episode], list[SplitPlacement], list[Refusal]]:
    """Episodes with the group and split of each; refused are those that declared groups tear."""
    dataset = recipe.dataset
    kept: list[Episode] = []
    placements: list[SplitPlacement] = []
    refused: list[Refusal] = []
    drives = [_drive(episode) for episode in episodes]
    placed = place_recordings(drives, dataset.split, dataset.seed)
    for episode, placement in zip(episodes, placed, strict=True):
        if isinstance(placement, str):
            refused.append(Refusal(episode.path, episode.digest, placement))
        else:
            kept.append(episode)
            placements.append(placement)
    return kept, placements, refused


def _no_rows(episodes: Sequence[Episode], refused: Sequence[Refusal]) -> str:
    reasons = [f"  {refusal.reason}" for refusal in refused]
    reasons += [f"  {_summary(episode)}" for episode in episodes]
    return "No recording makes a row, so no dataset is written:\n" + "\n".join(reasons)


def _shard_tasks(
    recipe: DatasetRecipe,
    columns: Sequence[Column],
    parts: Sequence[Part],
    entries: Sequence[RecordingEntry],
    out: Path,
) -> dict[str, list[ShardTask]]:
    sources = [
        EpisodeSource(number, part.rows, part.episode.folders) for number, part in enumerate(parts)
    ]
    dataset = recipe.dataset
    tasks: dict[str, list[ShardTask]] = {}
    for split in SPLITS:
        chosen = [
            source for source, entry in zip(sources, entries, strict=False) if entry.split == split
        ]
        tasks[split] = list(
            plan_shards(
                out.resolve(), split, columns, chosen, dataset.storage.rows_per_shard, dataset.seed
            )
        )
    return tasks


def _make_shards(
    tasks: dict[str, list[ShardTask]],
    earlier: dict[str, ShardFile],
    workers: Workers,
    progress: Progress,
) -> dict[str, list[ShardFile]]:
    missing = [task for split in tasks.values() for task in split if task.path not in earlier]
    made = dict(earlier)
    progress.start("shards", len(missing))
    for task, shard in run_all(workers, make_shard, missing):
        if shard is None:
            raise StageError(
                f"{task.path}: its worker process ended, as when memory runs out: lower "
                f"`storage.rows_per_shard` or use fewer workers."
            )
        made[task.path] = shard
        progress.advance(f"{task.path}: {shard.rows} rows, {shard.bytes / 1e6:.1f} MB")
    return {split: [made[task.path] for task in listed] for split, listed in tasks.items()}
