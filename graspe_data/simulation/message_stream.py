"""The messages of a simulated drive, in the order of their stamps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.simulation.camera.develop import encode_jpeg
from graspe_data.simulation.field import part_generator
from graspe_data.simulation.messages import SECOND, Messages
from graspe_data.simulation.motion.drive import STEP_S
from graspe_data.simulation.simulated_drive import SimulatedDrive

START_NS = 1_700_000_000 * SECOND
"""The stamp of a drive's first step."""
MILLISECOND = 1_000_000
IMU_NOISE = (0.08, 0.004)
"""Standard deviations of a sample: m/s^2 and rad/s."""


@dataclass(frozen=True)
class Message:
    """A message, when it was stamped, and when it reached the recorder at the earliest; ns."""

    topic: str
    content: Any
    stamp_ns: int
    delay_ns: int


@dataclass(frozen=True)
class _Source:
    topic: str
    rate: float
    delay_ns: int
    make: Callable[[int, int], Any]
    first: int = 0


class MessageStream:
    """Iterates over the messages of a drive; a picture and a turn at a time are in memory."""

    def __init__(self, simulated: SimulatedDrive) -> None:
        """Prepare the generators of the sensors' noise."""
        self._simulated, self._driven = simulated, simulated.driven
        self._messages = Messages(simulated.robot)
        self._jpeg = b""
        self._velocity = np.gradient(self._driven.position, STEP_S, axis=0)
        self._noise = {
            part: part_generator(simulated.scenario, simulated.seed, part)
            for part in ("camera", "lidar", "imu")
        }

    def __iter__(self) -> Iterator[Message]:
        """Make the messages one after another."""
        yield Message("/tf_static", self._mountings(), START_NS, 0)
        sources = self._sources()
        schedule = sorted(
            (step, order)
            for order, source in enumerate(sources)
            for step in range(source.first, len(self._driven.time_s), _period(source.rate))
        )
        for step, order in schedule:
            source, stamp_ns = sources[order], stamp_of(step)
            yield Message(source.topic, source.make(step, stamp_ns), stamp_ns, source.delay_ns)

    def _sources(self) -> list[_Source]:
        """Every topic that the robot's manifest names, with the delay of its driver."""
        scenario, topics = self._simulated.scenario, self._simulated.robot.topics
        rates, camera, lidar = scenario.rates, scenario.camera.rate, scenario.lidar.rate
        turn_ns = round(SECOND / scenario.lidar.rotation_rate)
        planned: list[tuple[str | None, float, int, Callable[[int, int], Any]]] = [
            (topics.odometry, rates.odometry, 3 * MILLISECOND, self._odometry),
            ("/tf", rates.odometry, 3 * MILLISECOND, self._frame),
            (topics.imu, rates.imu, 2 * MILLISECOND, self._inertial),
            (topics.command, rates.command, 0, self._command),
            (topics.camera_info, camera, 20 * MILLISECOND, self._calibration),
            (topics.image, camera, 21 * MILLISECOND, self._picture),
            (topics.points, lidar, turn_ns + 5 * MILLISECOND, self._cloud),
        ]
        phase = self._simulated.lidar_phase
        return [
            _Source(topic, rate, delay, make, phase if topic == topics.points else 0)
            for topic, rate, delay, make in planned
            if topic is not None
        ]

    def _mountings(self) -> Any:
        simulated, messages = self._simulated, self._messages
        edges = {
            (messages.base, messages.camera): simulated.camera.base_from_camera,
            (messages.base, messages.lidar): simulated.lidar.base_from_lidar,
        }
        return messages.transforms(START_NS, edges)

    def _reported_pose(self, step: int) -> Transform:
        """The base as the odometry has it: on drifting x, y and yaw, with the body's true tilt."""
        driven = self._driven
        x, y, yaw = driven.odometry[step]
        roll, pitch, _ = driven.attitude[step]
        rise = driven.position[step, 2] - driven.position[0, 2]
        place = np.array([x, y, self._simulated.robot.base_height + rise])
        return Transform(rotation_from_rpy(roll, pitch, yaw), place)

    def _odometry(self, step: int, stamp_ns: int) -> Any:
        v, omega = self._driven.measured[step].tolist()
        return self._messages.odometry(stamp_ns, self._reported_pose(step), v, omega)

    def _frame(self, step: int, stamp_ns: int) -> Any:
        edge = (self._messages.odom, self._messages.base)
        return self._messages.transforms(stamp_ns, {edge: self._reported_pose(step)})

    def _inertial(self, step: int, stamp_ns: int) -> Any:
        draw, (shaking, turning) = self._noise["imu"], IMU_NOISE
        acceleration = self._driven.acceleration[step] + draw.normal(0, shaking, 3)
        gyro = self._driven.gyro[step] + draw.normal(0, turning, 3)
        return self._messages.inertial(stamp_ns, acceleration, gyro)

    def _command(self, step: int, stamp_ns: int) -> Any:
        del stamp_ns
        return self._messages.twist(*self._driven.command[step].tolist())

    def _calibration(self, step: int, stamp_ns: int) -> Any:
        del step
        return self._messages.calibration(stamp_ns, self._simulated.camera.intrinsics)

    def _picture(self, step: int, stamp_ns: int) -> Any:
        simulated, time_s = self._simulated, float(self._driven.time_s[step])
        if self._jpeg and simulated.covers.frozen_since(time_s) is not None:
            return self._messages.picture(stamp_ns, self._jpeg)
        pose = self._driven.base_pose(time_s)
        twist = pose.rotation.T @ self._velocity[step], self._driven.gyro[step]
        rgb = simulated.camera.picture(
            pose, twist, self._noise["camera"], simulated.covers.on_lens(time_s)
        )
        self._jpeg = encode_jpeg(rgb, simulated.scenario.camera.jpeg_quality)
        return self._messages.picture(stamp_ns, self._jpeg)

    def _cloud(self, step: int, stamp_ns: int) -> Any:
        simulated, time_s = self._simulated, float(self._driven.time_s[step])
        points = simulated.lidar.turn(
            time_s,
            self._driven.base_pose,
            self._noise["lidar"],
            simulated.covers.on_lidar(time_s),
        )
        return self._messages.cloud(stamp_ns, points)


def _period(rate: float) -> int:
    """Steps between two messages."""
    return round(1 / rate / STEP_S)


def stamp_of(step: int) -> int:
    """The stamp of a step of the drive in ns."""
    return START_NS + step * round(STEP_S * SECOND)
