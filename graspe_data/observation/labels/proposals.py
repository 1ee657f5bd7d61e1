"""All rules over one recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from graspe_data.manifest import Settings
from graspe_data.observation.labels.collision import CollisionSettings, collision_events
from graspe_data.observation.labels.events import Event, EventKind
from graspe_data.observation.labels.motion_series import MotionSeries
from graspe_data.observation.labels.oscillation import OscillationSettings, oscillation_events
from graspe_data.observation.labels.stuck import StuckSettings, stuck_events
from graspe_data.observation.labels.stumble import StumbleSettings, stumble_events

SWITCHED_OFF = "switched off by the configuration"


class ProposalSettings(Settings):
    """The rules and their thresholds; None switches a rule off."""

    stuck: StuckSettings | None = StuckSettings()
    collision: CollisionSettings | None = CollisionSettings()
    oscillation: OscillationSettings | None = OscillationSettings()
    stumble: StumbleSettings | None = StumbleSettings()


@dataclass(frozen=True)
class Proposals:
    """What the rules propose, in order of time, and which kinds they could not judge, and why."""

    events: tuple[Event, ...]
    unavailable: Mapping[EventKind, str]


def propose(series: MotionSeries, settings: ProposalSettings) -> Proposals:
    """Propose failures by every rule for which the recording holds the data."""
    reasons = _reasons(series, settings)
    found: list[Event] = []
    if settings.stuck and series.command and "stuck" not in reasons:
        found += stuck_events(series.odometry, series.command, settings.stuck)
    if settings.collision:
        found += collision_events(
            series.odometry, series.command, series.inertial, settings.collision
        )
    if settings.oscillation:
        found += oscillation_events(series.odometry, settings.oscillation)
    if settings.stumble and "stumble" not in reasons:
        found += stumble_events(series.odometry, series.inertial, settings.stumble)
    ordered = sorted(found, key=lambda event: (event.start_ns, event.stop_ns, event.kind))
    return Proposals(tuple(ordered), reasons)


def _reasons(series: MotionSeries, settings: ProposalSettings) -> dict[EventKind, str]:
    """Why a kind is not judged, for every kind that is not."""
    reasons: dict[EventKind, str] = {}
    if series.command is None or not series.command.stamps_ns.size:
        reasons["stuck"] = "no commands in the recording: name their topic in the robot manifest"
    tilts = series.odometry.roll is not None and series.odometry.pitch is not None
    if not tilts and (series.inertial is None or not series.inertial.stamps_ns.size):
        reasons["stumble"] = "no IMU, and the odometry is planar"
    rules: dict[EventKind, Settings | None] = {
        "stuck": settings.stuck,
        "collision": settings.collision,
        "oscillation": settings.oscillation,
        "stumble": settings.stumble,
    }
    return reasons | {kind: SWITCHED_OFF for kind, rule in rules.items() if rule is None}
