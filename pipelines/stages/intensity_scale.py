"""On which scale a recording's intensities are, told by its first clouds together."""

from __future__ import annotations

from itertools import islice
from typing import Final

from graspe_data.errors import ObservationError, RecordingError
from graspe_data.observation.intensity_map.strength import IntensityScale
from graspe_data.recordings.decoding.lidars.cloud_source import CloudMessage, CloudSource
from graspe_data.recordings.recording import Recording
from graspe_data.robot import Robot

FIRST_CLOUDS: Final = 50


def recording_scale(recording: Recording, robot: Robot, maximum: float) -> IntensityScale:
    """The scale that the first clouds tell; undecided where they do not.

    It depends on the recording alone, not on which rows are asked for.

    Args:
        recording: Open.
        robot: Its topic of clouds and its lidar.
        maximum: The greatest value of the declared scale.
    """
    topic, scale = robot.topics.points, IntensityScale(maximum)
    source = CloudSource(recording, topic, robot.lidar)
    gathered = source.gather(recording.messages([topic]))
    clouds = (item for item in gathered if isinstance(item, CloudMessage))
    for message in islice(clouds, FIRST_CLOUDS):
        try:
            scale.strength(message.decode().intensity)
        except (RecordingError, ObservationError):
            continue
        break
    return scale
