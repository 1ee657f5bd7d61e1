"""The failures that really happened on a drive."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from graspe_data.arrays import Mask
from graspe_data.manifest import Positive, Settings
from graspe_data.observation.labels.events import Event, join_intervals, true_runs
from graspe_data.simulation.motion.drive import STEP_S, Contacts, Drive

STEP_NS = round(STEP_S * 1e9)


class EventSettings(Settings):
    """What counts as a failure."""

    impact: Positive = 0.1
    """m/s, lost at once to something solid."""
    scrape_s: Annotated[float, Field(ge=0)] = 1.0
    """Seconds; impacts that follow no later than this belong to the same collision."""
    standing: Positive = 0.05
    """m/s; a slower robot stands, and its collision is over."""
    asked_speed: Positive = 0.1
    """m/s; a slower command is no demand to drive."""
    asked_yaw_rate: Positive = 0.1
    """rad/s; looked at where no speed is asked for."""
    held_share: Annotated[float, Field(gt=0, lt=1)] = 0.2
    """Of the command; a slower robot is held."""
    held_s: Positive = 1.0
    """Seconds; held for less, it is not stuck."""
    slack_s: Annotated[float, Field(ge=0)] = 0.1
    """Seconds; a robot that gets on for no longer is held all the same."""


def true_events(drive: Drive, settings: EventSettings | None = None) -> list[Event]:
    """Collisions, stuck and stumbles, in order of time; ns from the drive's start.

    A collision lasts from the first impact until the robot stands after the last; stuck, while
    less than the held share of the command is done and something solid or entangling is the cause;
    a stumble, while the robot is off its gait.
    """
    settings = settings or EventSettings()
    found = [*_collisions(drive, settings), *_stuck(drive, settings), *_stumbles(drive.contacts)]
    return sorted(found, key=lambda event: (event.start_ns, event.stop_ns, event.kind))


def _collisions(drive: Drive, settings: EventSettings) -> list[Event]:
    impact = drive.contacts.impact
    hits = np.flatnonzero(impact >= settings.impact)
    stands = np.flatnonzero(np.abs(drive.velocity[:, 0]) < settings.standing)
    stands = np.append(stands, len(impact) - 1)
    ends = stands[np.searchsorted(stands[:-1], hits)]
    starts, stops = join_intervals(hits, ends, round(settings.scrape_s / STEP_S))
    return [
        Event("collision", first * STEP_NS, last * STEP_NS, f"{impact[first]:.2f} m/s")
        for first, last in zip(starts.tolist(), stops.tolist(), strict=True)
    ]


def _stuck(drive: Drive, settings: EventSettings) -> list[Event]:
    found = []
    runs = np.array(_runs(_held(drive, settings)), np.int64).reshape(-1, 2)
    joined = join_intervals(runs[:, 0], runs[:, 1], round(settings.slack_s / STEP_S))
    for first, last in zip(*(ends.tolist() for ends in joined), strict=True):
        within = slice(first, last + 1)
        entangled = np.count_nonzero(drive.contacts.entangled[within])
        stopped = np.count_nonzero(drive.contacts.stopped[within])
        if entangled + stopped and (last - first) * STEP_S >= settings.held_s:
            evidence = "entangled" if entangled >= stopped else "blocked"
            found.append(Event("stuck", first * STEP_NS, last * STEP_NS, evidence))
    return found


def _held(drive: Drive, settings: EventSettings) -> Mask:
    commanded, driven = np.abs(drive.command), np.abs(drive.velocity)
    drives = commanded[:, 0] >= settings.asked_speed
    turns = ~drives & (commanded[:, 1] >= settings.asked_yaw_rate)
    held = driven < settings.held_share * commanded
    mask: Mask = (drives & held[:, 0]) | (turns & held[:, 1])
    return mask


def _stumbles(contacts: Contacts) -> list[Event]:
    return [
        Event("stumble", first * STEP_NS, last * STEP_NS, "rock")
        for first, last in _runs(contacts.stumbling)
    ]


def _runs(mask: Mask) -> list[tuple[int, int]]:
    stamps = np.arange(len(mask)) * STEP_NS
    first, last = true_runs(mask, stamps, STEP_NS)
    return list(zip(first.tolist(), last.tolist(), strict=True))
