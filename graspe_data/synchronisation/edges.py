"""The edges of tf, sorted into fixed and moving ones, and where their publishers disagree."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.arrays import Floats, Mask, Stamps
from graspe_data.geometry import Transform
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.tracks import EdgeTrack
from graspe_data.synchronisation.transform_buffer import Edge, FixedEdge

FEW_CHANGES: Final = 3
"""A transform that changed no more often is fixed, and was set anew."""
_SAME: Final = 1e-6
_SEEN_OFTEN: Final = 10


@dataclass(frozen=True)
class Edges:
    """Edges by (parent, child): fixed ones of all their topics, moving ones of one topic each."""

    fixed: Mapping[Edge, tuple[EdgeTrack, ...]]
    moving: Mapping[Edge, EdgeTrack]
    findings: tuple[Finding, ...]

    def only(self, kept: Callable[[EdgeTrack], Mask]) -> Edges:
        """The moving edges' samples that a mask (N,) keeps; fixed edges belong to all parts."""
        parts = {edge: track.only(kept(track)) for edge, track in self.moving.items()}
        there = {edge: track for edge, track in parts.items() if track.stamps.bag_ns.size}
        return Edges(self.fixed, there, self.findings)

    def fixed_edges(self, axis: Callable[[EdgeTrack], Stamps]) -> dict[Edge, FixedEdge]:
        """The fixed edges on a time axis.

        Args:
            axis: Gives the times of a track's samples, int64 (N,).
        """
        return {edge: _in_time(tracks, axis) for edge, tracks in self.fixed.items()}


def sort_edges(tracks: Sequence[EdgeTrack], unusable: Sequence[str] = ()) -> Edges:
    """Tell fixed from moving edges; of several topics the last, most special one is believed.

    Args:
        tracks: The most general topic first.
        unusable: What was skipped while reading.
    """
    by_edge: dict[Edge, list[EdgeTrack]] = {}
    for track in tracks:
        by_edge.setdefault((track.parent, track.child), []).append(track)
    fixed: dict[Edge, tuple[EdgeTrack, ...]] = {}
    moving: dict[Edge, EdgeTrack] = {}
    findings = [
        Finding("edge_unusable", "noted", text.partition(":")[0], text) for text in unusable
    ]
    for edge, found in sorted(by_edge.items()):
        restless = [track for track in found if _moves(track)]
        findings += _disagreements(found, restless)
        if restless:
            moving[edge] = restless[-1]
        else:
            fixed[edge] = tuple(found) if _apart(found) <= _SAME else (found[-1],)
    dropped, of_parents = _second_parents(fixed)
    of_parents += _moving_parents(moving, {e: t for e, t in fixed.items() if e not in dropped})
    kept = {edge: tracks for edge, tracks in fixed.items() if edge not in dropped}
    return Edges(kept, moving, (*findings, *of_parents))


def _moves(track: EdgeTrack) -> bool:
    """Whether an edge is one of a moving frame.

    Not one of a topic of static transforms; nor one that is repeated and hardly ever changes.
    """
    if track.latched:
        return False
    changes = _changes(track)
    return changes > FEW_CHANGES or (changes > 0 and track.stamps.bag_ns.size < _SEEN_OFTEN)


def _table(track: EdgeTrack) -> Floats:
    """Translation and quaternion of unit length and positive sign, (N, 7)."""
    unit = track.quaternion / np.linalg.norm(track.quaternion, axis=1, keepdims=True)
    largest = np.take_along_axis(unit, np.abs(unit).argmax(axis=1)[:, None], axis=1)
    return np.concatenate([track.translation, unit * np.sign(largest)], axis=1)


def _changes(track: EdgeTrack) -> int:
    steps = np.abs(np.diff(_table(track), axis=0)).max(axis=1, initial=0.0)
    return int(np.count_nonzero(steps > _SAME))


def _in_time(tracks: Sequence[EdgeTrack], axis: Callable[[EdgeTrack], Stamps]) -> FixedEdge:
    stamps = np.concatenate([axis(track) for track in tracks])
    table = np.concatenate([_table(track) for track in tracks])
    order = np.argsort(stamps, kind="stable")
    stamps, table = stamps[order], table[order]
    new = np.ones(stamps.size, np.bool_)
    new[1:] = np.abs(np.diff(table, axis=0)).max(axis=1) > _SAME
    transforms = [Transform.from_quaternion(row[:3], row[3:]) for row in table[new]]
    return FixedEdge(stamps[new], tuple(transforms))


def _disagreements(found: Sequence[EdgeTrack], restless: Sequence[EdgeTrack]) -> list[Finding]:
    name, topics = found[0].name, " and ".join(sorted({track.stamps.topic for track in found}))
    apart = _apart(found)
    if len(found) > 1 and (restless or apart > _SAME):
        text = (
            f"{name} has two publishers, {topics}, {apart:.3f} m apart at first; that of "
            f"{(restless or found)[-1].stamps.topic} counts"
        )
        return [Finding("edge_published_twice", "noted", name, text, {"apart_m": apart})]
    return []


def _apart(found: Sequence[EdgeTrack]) -> float:
    first, last = found[0].translation[0], found[-1].translation[0]
    return float(np.linalg.norm(first - last))


def _second_parents(
    fixed: Mapping[Edge, tuple[EdgeTrack, ...]],
) -> tuple[set[Edge], list[Finding]]:
    """Of a fixed frame with two parents the one published last counts, as in tf2."""
    parents: dict[str, list[Edge]] = {}
    for parent, child in fixed:
        parents.setdefault(child, []).append((parent, child))
    dropped: set[Edge] = set()
    findings = []
    for child, edges in sorted(parents.items()):
        if len(edges) == 1:
            continue
        last = max(edges, key=lambda edge: _published(fixed[edge]))
        dropped |= set(edges) - {last}
        places = "; ".join(f"{p} at {_place(fixed[p, child])}" for p, _ in sorted(edges))
        text = f"{child} has {len(edges)} parents: {places}. {last[0]}, published last, counts"
        findings.append(Finding("two_parents", "noted", child, text))
    return dropped, findings


def _moving_parents(
    moving: Mapping[Edge, EdgeTrack], fixed: Mapping[Edge, tuple[EdgeTrack, ...]]
) -> list[Finding]:
    """Frames that move against several parents, or against one and are fixed to another."""
    children = sorted({child for _, child in moving})
    found = []
    for child in children:
        parents = sorted(parent for parent, other in (*moving, *fixed) if other == child)
        if len(parents) > 1:
            text = (
                f"{child} has {len(parents)} parents: {', '.join(parents)}: the one on the shorter "
                f"path counts"
            )
            found.append(Finding("two_parents", "noted", child, text))
    return found


def _published(tracks: Sequence[EdgeTrack]) -> tuple[int, int]:
    return max((int(track.stamps.bag_ns[-1]), int(track.stamps.order[-1])) for track in tracks)


def _place(tracks: Sequence[EdgeTrack]) -> str:
    x, y, z = tracks[-1].translation[-1].tolist()
    return f"({x:.2f}, {y:.2f}, {z:.2f}) m"
