"""What ``dataset.json`` says of a dataset and its recordings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from pydantic import JsonValue

from graspe_data.columns import Column
from graspe_data.shards.dataset_index import DatasetIndex, RecordingEntry, ShardFile
from pipelines.dataset_settings import DatasetRecipe
from pipelines.parts import Part
from pipelines.process_recording import Refusal
from pipelines.splits import split_of
from pipelines.statistics import episode_statistics


def recording_entry(part: Part) -> RecordingEntry:
    """What a dataset keeps of a recording that was read, or of what one split has of it."""
    episode, placement = part.episode, part.placement
    extracted, labelled = episode.extracted, episode.labelled
    losses = [loss.model_dump(mode="json") for loss in extracted.losses]
    details: dict[str, JsonValue] = {
        **extracted.calibration.model_dump(mode="json"),
        "time_zero_ns": extracted.time_zero_ns,
        "content": extracted.content.digest or None,
        "overlaps": list(placement.linked),
        "world": labelled.world or None,
        "files": list(episode.files),
        "offsets_ns": dict(extracted.offsets_ns),
        "damage": [dict(loss) for loss in losses],
        "findings": [finding.model_dump(mode="json") for finding in extracted.findings],
        "shifts_ns": list(extracted.shifts_ns),
        "annotated": labelled.annotated,
        "events": dict(labelled.events),
        "not_judged": dict(labelled.unavailable),
        "statistics": episode_statistics(episode, part.rows),
        **({"blocks_ns": [list(span) for span in part.blocks_ns]} if part.blocks_ns else {}),
    }
    return RecordingEntry(
        name=episode.path.name,
        digest=episode.digest,
        group=placement.group,
        split=placement.split if part.rows.size else None,
        rows=part.rows.size,
        losses=part.lost,
        columns={k: v for record in episode.records.values() for k, v in record.columns.items()},
        stages={stage: record.key for stage, record in episode.records.items()},
        details=details,
    )


def refused_entry(recipe: DatasetRecipe, refusal: Refusal) -> RecordingEntry:
    """What a dataset keeps of a recording that was refused: its name and the reason."""
    dataset = recipe.dataset
    group, _ = split_of(refusal.path.name, refusal.digest, dataset.split, dataset.seed)
    counted = {"counted_as": refusal.counted_as} if refusal.counted_as else {}
    return RecordingEntry(
        name=refusal.path.name,
        digest=refusal.digest,
        group=group,
        details={
            "refused": refusal.reason.replace(str(refusal.path), refusal.path.name),
            **counted,
        },
    )


def dataset_index(
    recipe: DatasetRecipe,
    columns: Sequence[Column],
    entries: Sequence[RecordingEntry],
    shards: dict[str, list[ShardFile]],
) -> DatasetIndex:
    """The content of ``dataset.json``, but for its digest."""
    # Without their columns these settings decide nothing, so the digest does not depend on them.
    unused = set() if recipe.dataset.intensity_layers else {"intensity_map"}
    unused |= set() if recipe.dataset.candidates else {"candidates"}
    unused |= set() if recipe.dataset.recording_clocks else {"recording_clocks"}
    dataset = recipe.dataset.model_dump(mode="json", exclude={"storage"} | unused)
    if recipe.dataset.split.by_time is None:
        del dataset["split"]["by_time"]
    losses = sum((Counter(entry.losses) for entry in entries), Counter[str]())
    return DatasetIndex(
        name=recipe.dataset.name,
        columns=tuple(columns),
        group_key="recordings and declared groups",
        splits=shards,
        recordings=list(entries),
        losses=dict(losses),
        configuration={"dataset": dataset, "robot": recipe.robot.model_dump(mode="json")},
        storage=recipe.dataset.storage.model_dump(mode="json"),
        order_seed=recipe.dataset.seed,
        statistics={split: _totals(split, entries) for split in shards},
    )


def _totals(split: str, entries: Sequence[RecordingEntry]) -> JsonValue:
    totals: Counter[str] = Counter()
    for entry in entries:
        statistics = entry.details.get("statistics")
        if entry.split == split and isinstance(statistics, dict):
            totals["rows"] += entry.rows
            totals.update({k: n for k, n in statistics.items() if isinstance(n, int)})
    return dict(totals)
