"""Messages to arrays: one decoder a kind of sensor, for ROS 1 and ROS 2 alike."""

from graspe_data.recordings.decoding.calibration import decode_calibration
from graspe_data.recordings.decoding.cloud_decoder import cloud_decoder
from graspe_data.recordings.decoding.images import decode_image
from graspe_data.recordings.decoding.motion import decode_inertial, decode_motion, decode_transforms
from graspe_data.recordings.decoding.picture_decoder import PictureDecoder
from graspe_data.recordings.decoding.point_clouds import decode_points, decode_scan
from graspe_data.recordings.decoding.velodyne import VelodyneDecoder

__all__ = [
    "PictureDecoder",
    "VelodyneDecoder",
    "cloud_decoder",
    "decode_calibration",
    "decode_image",
    "decode_inertial",
    "decode_motion",
    "decode_points",
    "decode_scan",
    "decode_transforms",
]
