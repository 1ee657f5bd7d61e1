"""What leaps of the poses say: a reset, a spike, two publishers, or limits that are too low."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.errors import RecordingError
from graspe_data.robot import Robot
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.motion_samples import SECOND, MotionSamples

OFTEN: Final = 0.05
"""Of the samples: what is rarer is an outlier or a jump, what is not is a fault of the source."""
_ROUGH_M: Final = 0.02


def jump_findings(stretches: Sequence[MotionSamples], robot: Robot) -> list[Finding]:
    """Tell of leaps and spikes.

    Args:
        stretches: The motion of each stretch, cut at its jumps.
        robot: Its limits and topics.

    Raises:
        RecordingError: They are no exceptions: two publishers, or limits that are too low.
    """
    leaps = _Leaps.of(stretches)
    if leaps.share > OFTEN:
        raise RecordingError(_refusal(leaps, stretches, robot))
    topic, found = robot.topics.odometry, []
    if leaps.jumps:
        way, seconds = leaps.jumps[0]
        often = "once," if len(leaps.jumps) == 1 else f"{len(leaps.jumps)} times, first"
        text = (
            f"{topic}: the pose jumps {often} by {way:.2f} m in {seconds:.3f} s: a reset or a "
            f"relocalisation; nothing is interpolated or differentiated across"
        )
        numbers = {"jumps": float(len(leaps.jumps)), "way_m": way, "time_s": seconds}
        found.append(Finding("pose_jumps", "mended", topic, text, numbers))
    if leaps.spikes:
        way, seconds = leaps.spikes[0]
        text = (
            f"{topic}: {len(leaps.spikes)} times up to three poses lie elsewhere than those before "
            f"and after, first {way:.2f} m away after {seconds:.3f} s: they are left out"
        )
        numbers = {"spikes": float(len(leaps.spikes)), "way_m": way, "time_s": seconds}
        found.append(Finding("pose_spikes", "mended", topic, text, numbers))
    beside = _beside_m(stretches)
    if beside > _ROUGH_M:
        text = (
            f"{topic}: poses lie {beside:.3f} m, as a rule, beside the line from the one before to "
            f"the one after: two publishers, or noise"
        )
        found.append(Finding("poses_scatter", "noted", topic, text, {"beside_m": beside}))
    return found


@dataclass(frozen=True)
class _Leaps:
    """Leaps as (metres, seconds), and which share of the samples they or repeated stamps are."""

    jumps: list[tuple[float, float]]
    spikes: list[tuple[float, float]]
    repeated: float
    samples: int

    @classmethod
    def of(cls, stretches: Sequence[MotionSamples]) -> _Leaps:
        return cls(
            [_leap(samples, int(index)) for samples in stretches for index in samples.jumps],
            [(way, time) for samples in stretches for way, time in samples.spikes.tolist()],
            max((samples.repeated for samples in stretches), default=0.0),
            sum(s.stamps_ns.size + len(s.spikes) for s in stretches),
        )

    @property
    def share(self) -> float:
        often = (len(self.jumps) + len(self.spikes)) / max(1, self.samples)
        return max(often, self.repeated)


def _refusal(leaps: _Leaps, stretches: Sequence[MotionSamples], robot: Robot) -> str:
    topic, fastest = robot.topics.odometry, max(map(abs, robot.limits.linear_velocity))
    every = sorted([*leaps.jumps, *leaps.spikes])
    way, seconds = every[len(every) // 2] if every else (0.0, 0.0)
    typical = _typical_speed(stretches)
    if leaps.jumps and typical > 2 * fastest and leaps.repeated <= OFTEN:
        return (
            f"{topic}: its poses move at {typical:.2f} m/s as a rule, and the robot manifest's "
            f"limit is {fastest:g} m/s. No rows are made. Correct `limits`, or name another "
            f"odometry."
        )
    if leaps.repeated > OFTEN:
        lies = f"{100 * leaps.repeated:.0f} % of its messages repeat a stamp with another pose"
    else:
        lies = (
            f"{100 * leaps.share:.0f} % of its poses lie elsewhere than the ones before, as a rule "
            f"{way:.2f} m away after {seconds:.3f} s, which is faster than twice the robot's limit "
            f"of {fastest:g} m/s"
        )
    return (
        f"{topic}: two publishers seem to write it: {lies}. No rows are made. Record one of them "
        f"alone, or name another odometry under `topics.odometry`."
    )


def _leap(samples: MotionSamples, behind: int) -> tuple[float, float]:
    step = samples.position[behind] - samples.position[behind - 1]
    time = samples.stamps_ns[behind] - samples.stamps_ns[behind - 1]
    return float(np.linalg.norm(step)), float(time) / SECOND


def _beside_m(stretches: Sequence[MotionSamples]) -> float:
    """The median distance of poses from the line between their neighbours, metres."""
    found: list[float] = []
    for samples in stretches:
        seconds = (samples.stamps_ns - samples.stamps_ns[:1]) / SECOND
        near = samples.joined[:-1] & samples.joined[1:]
        before, own, after = samples.position[:-2], samples.position[1:-1], samples.position[2:]
        share = (seconds[1:-1] - seconds[:-2]) / (seconds[2:] - seconds[:-2])
        beside = np.linalg.norm(own - before - share[:, None] * (after - before), axis=1)[near]
        found += beside[np.isfinite(beside)].tolist()
    return float(np.median(found)) if found else 0.0


def _typical_speed(stretches: Sequence[MotionSamples]) -> float:
    """The median speed over whole seconds, so that leaps to and fro cancel out."""
    speeds: list[float] = []
    for samples in stretches:
        seconds = (samples.stamps_ns - samples.stamps_ns[0]) * 1e-9
        later = np.searchsorted(seconds, seconds + 1.0)
        inside = later < seconds.size
        way = samples.position[later[inside]] - samples.position[inside]
        speeds += (
            np.linalg.norm(way, axis=1) / (seconds[later[inside]] - seconds[inside])
        ).tolist()
    return float(np.median(speeds)) if speeds else 0.0
