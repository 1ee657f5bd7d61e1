"""What a robot's sensors have handed on while it drives, as late as its drivers are."""

from __future__ import annotations

from typing import Final

import numpy as np

from graspe_data.recordings.decoding import decode_image, decode_points
from graspe_data.sensor_data import Picture, PointCloud
from graspe_data.simulation.camera.develop import encode_jpeg
from graspe_data.simulation.field import Field, part_generator
from graspe_data.simulation.message_stream import stamp_of
from graspe_data.simulation.messages import Messages
from graspe_data.simulation.motion.drive import STEP_S, Drive
from graspe_data.simulation.motion.drive_in_progress import DriveInProgress

IMAGE_TYPE: Final = "sensor_msgs/msg/CompressedImage"
PICTURE_DELAY_S: Final = 0.03
"""From a picture's stamp until it is there; as in recordings."""
TRANSFER_DELAY_S: Final = 0.01
"""From the end of a turn of the lidar until its cloud is there."""
SMOOTHED_S: Final = 0.6
"""Over which the body's tilt and the gait depend on what was before."""


class LiveSensors:
    """The latest picture and the latest cloud of a robot on its way.

    Each is made when it is first asked for, from the way so far, and decoded from the message that
    a recording would hold. Its noise depends on the seed and its stamp alone, not on what else was
    asked for. A sensor has been on before the robot starts.
    """

    def __init__(self, field: Field) -> None:
        """Take the field; the phase of the lidar is that of its recordings."""
        scenario = field.scenario
        self._field, self._messages = field, Messages(field.robot)
        self._picture_every, self._cloud_every = (
            round(1 / rate / STEP_S) for rate in (scenario.camera.rate, scenario.lidar.rate)
        )
        self._phase = field.lidar_phase
        self._turn_s = 1 / scenario.lidar.rotation_rate
        self._picture: tuple[int, Picture] | None = None
        self._cloud: tuple[int, PointCloud] | None = None

    def picture(self, way: DriveInProgress) -> Picture:
        """The latest picture that is there; at least two steps have to be taken."""
        late = round(PICTURE_DELAY_S / STEP_S)
        step = (way.steps - late) // self._picture_every * self._picture_every
        if self._picture is None or self._picture[0] != step:
            seen = self._seen(step)
            self._picture = (step, self._take_picture(_since(way, seen), seen, step))
        return self._picture[1]

    def cloud(self, way: DriveInProgress) -> PointCloud:
        """The latest cloud that is there; at least two steps have to be taken."""
        late = self._phase + round((self._turn_s + TRANSFER_DELAY_S) / STEP_S)
        step = (way.steps - late) // self._cloud_every * self._cloud_every + self._phase
        if self._cloud is None or self._cloud[0] != step:
            self._cloud = (step, self._turn(_since(way, step), step))
        return self._cloud[1]

    def _seen(self, step: int) -> int:
        """The step that the picture of a step shows: an earlier one while the camera is frozen."""
        since = self._field.covers.frozen_since(step * STEP_S)
        if since is None:
            return step
        return round(since / STEP_S) // self._picture_every * self._picture_every

    def _take_picture(self, drive: Drive, step: int, sent: int) -> Picture:
        field, time_s = self._field, step * STEP_S
        pose = drive.base_pose(time_s)
        row = int(np.clip(step - round(drive.time_s[0] / STEP_S), 0, len(drive.time_s) - 1))
        velocity = np.gradient(drive.position, STEP_S, axis=0)[row]
        rgb = field.camera.picture(
            pose,
            (pose.rotation.T @ velocity, drive.gyro[row]),
            self._noise("camera", step),
            field.covers.on_lens(time_s),
        )
        jpeg = encode_jpeg(rgb, field.scenario.camera.jpeg_quality)
        message = self._messages.picture(stamp_of(sent), jpeg)
        return decode_image(message, IMAGE_TYPE, field.robot.topics.image)

    def _turn(self, drive: Drive, step: int) -> PointCloud:
        field, time_s = self._field, step * STEP_S
        points = field.lidar.turn(
            time_s, drive.base_pose, self._noise("lidar", step), field.covers.on_lidar(time_s)
        )
        message = self._messages.cloud(stamp_of(step), points)
        return decode_points(message, field.robot.topics.points)

    def _noise(self, sensor: str, step: int) -> np.random.Generator:
        """Of one picture or cloud; steps before the start count too."""
        field = self._field
        return part_generator(field.scenario, field.seed, f"live {sensor}", step % 2**32)


def _since(way: DriveInProgress, step: int) -> Drive:
    """The way from shortly before a step on, for as long as the body's tilt remembers."""
    begin = min(step, way.steps - 2) - round(SMOOTHED_S / STEP_S)
    return way.drive(max(begin, 0))
