"""Open any recording, and decode its messages."""

from graspe_data.recordings.identity import recording_digest
from graspe_data.recordings.messages import Damage, RawMessage, TopicInfo
from graspe_data.recordings.recording import Recording, open_recording
from graspe_data.recordings.writing import RecordingWriter

__all__ = [
    "Damage",
    "RawMessage",
    "Recording",
    "RecordingWriter",
    "TopicInfo",
    "open_recording",
    "recording_digest",
]
