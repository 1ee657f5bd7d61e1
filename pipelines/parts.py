"""The rows of each recording that go to each split: all to one, or blocks of time to several."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Stamps
from graspe_data.errors import StageError
from pipelines.dataset_settings import DatasetManifest, TimeSplit
from pipelines.episode import whole_column
from pipelines.process_recording import Episode, Refusal
from pipelines.splits import SplitPlacement
from pipelines.time_blocks import GUARDED, SPLITS, TimeBlocks, plan_blocks


@dataclass(frozen=True)
class Part:
    """The rows of an episode that go to one split.

    Attributes:
        episode: Of the recording.
        placement: Their group and split.
        rows: int64 (R,), rising, of the episode.
        lost: What made no row of this part, counted by reason; of a recording in several parts its
            first has all.
        blocks_ns: From when to when its blocks of time last; empty where the recording is whole.
    """

    episode: Episode
    placement: SplitPlacement
    rows: NDArray[np.int64]
    lost: Mapping[str, int]
    blocks_ns: Sequence[tuple[int, int]] = field(default_factory=tuple)


def split_parts(
    manifest: DatasetManifest, episodes: Sequence[Episode], placements: Sequence[SplitPlacement]
) -> tuple[list[Part], list[Refusal]]:
    """The parts of each recording, in the order given, and those that cannot be cut into blocks."""
    time_split, pairs = manifest.split.by_time, list(zip(episodes, placements, strict=True))
    if time_split is None:
        return [_whole(*pair) for pair in pairs], []
    blocks = _blocks(manifest, time_split, pairs)
    parts: list[Part] = []
    refused: list[Refusal] = []
    for episode, placement in pairs:
        found = blocks.get(placement.drive)
        if isinstance(found, str):
            reason = f"{episode.path.name}: {found}"
            refused.append(Refusal(episode.path, episode.digest, reason))
        elif found is None or not episode.extracted.rows:
            parts.append(_whole(episode, placement))
        else:
            parts += _cut(episode, placement, found)
    return parts, refused


def _blocks(
    manifest: DatasetManifest,
    time_split: TimeSplit,
    pairs: Sequence[tuple[Episode, SplitPlacement]],
) -> dict[str, TimeBlocks | str]:
    """The blocks of each drive that no group declares, or why there are none."""
    anchors: dict[str, list[Stamps]] = {}
    for episode, placement in pairs:
        if not placement.declared and episode.extracted.rows:
            anchors.setdefault(placement.drive, []).append(_anchors(episode))
    found: dict[str, TimeBlocks | str] = {}
    for drive, stamps in anchors.items():
        try:
            found[drive] = plan_blocks(stamps, drive, time_split, manifest)
        except StageError as error:
            found[drive] = str(error)
    return found


def _anchors(episode: Episode) -> Stamps:
    stamps: Stamps = whole_column(episode.folders["extract"], "stamp_ns")
    return stamps


def _whole(episode: Episode, placement: SplitPlacement) -> Part:
    extracted = episode.extracted
    return Part(episode, placement, np.arange(extracted.rows), extracted.lost)


def _cut(episode: Episode, placement: SplitPlacement, blocks: TimeBlocks) -> list[Part]:
    """A part for each split that rows are in; one without rows where the guard takes all."""
    anchors = _anchors(episode)
    first, last = int(anchors.min()), int(anchors.max())
    guarded = blocks.guarded(anchors)
    lost = {**episode.extracted.lost, **({GUARDED: guarded} if guarded else {})}
    parts: list[Part] = []
    for split in SPLITS:
        rows = blocks.rows_of(anchors, split)
        if rows.size:
            place = replace(placement, split=split)
            spans = list(_touching(blocks.spans_ns(split), first, last))
            parts.append(Part(episode, place, rows, {} if parts else lost, spans))
    return parts or [Part(episode, placement, np.empty(0, np.int64), lost)]


def _touching(spans: Sequence[tuple[int, int]], first: int, last: int) -> Iterator[tuple[int, int]]:
    yield from ((start, stop) for start, stop in spans if start <= last and stop > first)
