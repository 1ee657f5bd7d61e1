"""The odometry of a recording, in time order."""

from __future__ import annotations

from graspe_data.errors import ObservationError, RecordingError
from graspe_data.observation.odometry_series import PoseSeries, odometry_series
from graspe_data.synchronisation.clocks import Timeline
from graspe_data.synchronisation.tracks import MotionTrack


def pose_series(track: MotionTrack, time: Timeline) -> PoseSeries:
    """The samples of a track as ``odometry_series`` has them.

    Raises:
        RecordingError: Fewer than two usable samples.
    """
    try:
        return odometry_series(time.stamps_ns, track.position, track.quaternion, track.velocity)
    except ObservationError as error:
        raise RecordingError(f"{track.stamps.topic}: {error}") from error
