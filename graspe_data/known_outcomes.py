"""How candidate trajectories would have ended: what only a simulated world can say."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.errors import RecordingError
from graspe_data.recordings import open_recording


@dataclass(frozen=True)
class KnownOutcomes:
    """K candidates at each of P moments, and how each would have ended.

    ``stamps_ns`` int64 (P,). ``velocities`` float64 (P, K, 2), m/s and rad/s, held from that moment
    on. ``success`` bool (P, K, T), at the end of each step of ``step_s`` seconds.
    """

    stamps_ns: NDArray[np.int64]
    velocities: NDArray[np.float64]
    success: NDArray[np.bool_]
    step_s: float

    def texts(self) -> Iterator[str]:
        """The message of every moment."""
        moments = zip(self.stamps_ns, self.velocities, self.success, strict=True)
        for stamp, velocities, success in moments:
            message = {"stamp_ns": int(stamp), "step_s": self.step_s}
            message |= {"velocities": velocities.tolist(), "success": success.astype(int).tolist()}
            yield json.dumps(message)


def read_outcomes(path: Path, topic: str) -> KnownOutcomes:
    """Read what a recording's topic says of candidates.

    Raises:
        RecordingError: There is no such topic, or it does not say what it should.
    """
    with open_recording(path) as recording:
        if topic not in recording.topics:
            raise RecordingError(
                f"{path}: no topic {topic}, which the dataset's `candidates.topic` names: only "
                f"recordings of `graspe simulate` have it. Leave `candidates` out, or record again."
            )
        messages: list[Any] = [recording.decode(raw) for raw in recording.messages([topic])]
    try:
        return _parsed([json.loads(message.data) for message in messages])
    except (AttributeError, ValueError, TypeError, KeyError) as error:
        raise RecordingError(
            f"{path}: {topic} does not hold what a simulation writes there: {error!r}. Record it "
            f"again."
        ) from error


def _parsed(moments: list[dict[str, Any]]) -> KnownOutcomes:
    velocities = np.array([moment["velocities"] for moment in moments], np.float64)
    success = np.array([moment["success"] for moment in moments], np.bool_)
    (step_s,) = {float(moment["step_s"]) for moment in moments}
    if velocities.ndim != 3 or velocities.shape[2] != 2:  # noqa: PLR2004 - (P, K, 2)
        raise ValueError(f"velocities of shape {velocities.shape}, expected (P, K, 2)")
    if success.ndim != 3 or success.shape[:2] != velocities.shape[:2]:  # noqa: PLR2004
        raise ValueError(f"success of shape {success.shape}, expected (P, K, T)")
    if not np.isfinite(velocities).all():
        raise ValueError("a velocity that is not finite")
    stamps = np.array([moment["stamp_ns"] for moment in moments], np.int64)
    return KnownOutcomes(stamps, velocities, success, step_s)
