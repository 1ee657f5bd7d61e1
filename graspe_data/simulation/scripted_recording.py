"""Record a scripted drive through a plain world, as a robot's own recorder would."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.recordings.message_types import message_classes
from graspe_data.recordings.writing import Compression, Container, RecordingWriter
from graspe_data.simulation.plain_world import (
    GRASS,
    GROUND,
    SKY,
    TRUNK,
    WALL,
    World,
    cast_rays,
    surface_noise,
)
from graspe_data.simulation.scripted_drive import STEP_S, Drive

START_NS = 1_700_000_000_000_000_000
SECOND = 1_000_000_000
BASE_HEIGHT = 0.5
CAMERA = Transform(
    rotation_from_rpy(0.0, 0.3, 0.0) @ np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]),
    np.array([0.4, 0.0, 0.25]),
)
LIDAR = Transform(np.eye(3), np.array([0.2, 0.0, 0.35]))
RINGS, COLUMNS = 16, 1800
LIDAR_REACH = 60.0
REFLECTIVITY = {GROUND: 60.0, TRUNK: 110.0, WALL: 200.0, GRASS: 40.0, SKY: 0.0}
COLOURS = {
    SKY: (170, 205, 240),
    GROUND: (120, 110, 70),
    TRUNK: (95, 65, 40),
    WALL: (175, 165, 155),
    GRASS: (90, 140, 50),
}
POINT_TYPE = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring", "time"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<f4"],
        "offsets": [0, 4, 8, 12, 16, 18],
        "itemsize": 22,
    }
)
POINT_FIELDS = (
    ("x", 0, 7),
    ("y", 4, 7),
    ("z", 8, 7),
    ("intensity", 12, 7),
    ("ring", 16, 4),
    ("time", 18, 7),
)


@dataclass(frozen=True)
class Sensors:
    """Rates in Hz, the picture's size, and how much light there is (1 = day)."""

    camera_rate: float = 10.0
    lidar_rate: float = 10.0
    odometry_rate: float = 50.0
    imu_rate: float = 100.0
    command_rate: float = 10.0
    width: int = 320
    height: int = 240
    light: float = 1.0

    def __post_init__(self) -> None:
        """Refuse rates that the simulation's step cannot keep."""
        for name in ("camera", "lidar", "odometry", "imu", "command"):
            steps = 1 / (getattr(self, f"{name}_rate") * STEP_S)
            if steps < 1 or abs(steps - round(steps)) > 1e-9:  # noqa: PLR2004
                raise ValueError(f"{name}_rate: {1 / STEP_S:g} Hz must be a multiple of it")

    @property
    def focal_length(self) -> float:
        """Pixels; the picture is 67 degrees wide."""
        return 0.75 * self.width


def record_drive(
    path: Path,
    container: Container,
    world: World,
    driven: Drive,
    sensors: Sensors,
    seed: int,
    compression: Compression = "none",
) -> None:
    """Write a recording of a drive; the same arguments give the same bytes.

    Topics are those of the shipped robot manifest ``spot``. Each message reaches the recorder a
    few milliseconds after its stamp.
    """
    generator = np.random.default_rng([seed, zlib.crc32(container.encode())])
    steps = DriveMessages(world, driven, sensors, np.random.default_rng(seed))
    with RecordingWriter(path, container, compression) as writer:
        writer.write("/tf_static", steps.mounting(), START_NS)
        for topic, message, stamp_ns, delay_ns in steps:
            jitter = int(generator.integers(0, 2_000_000))
            writer.write(topic, message, stamp_ns + delay_ns + jitter)


class DriveMessages:
    """The messages of a drive in order of their stamps: topic, message, stamp, delay in ns."""

    def __init__(
        self, world: World, driven: Drive, sensors: Sensors, generator: np.random.Generator
    ) -> None:
        """Prepare the rays of camera and lidar."""
        self.world, self.driven, self.sensors = world, driven, sensors
        self.generator = generator
        self.types: Any = {name.split("/")[-1]: kind for name, kind in message_classes().items()}
        self.pixels = _pixel_rays(sensors)
        self.beams = _beams()

    def __iter__(self) -> Iterator[tuple[str, Any, int, int]]:
        """Make the messages, in order of their stamps."""
        sensors = self.sensors
        makers = [
            ("/spot/odometry", sensors.odometry_rate, self.odometry, 3_000_000),
            ("/imu/data", sensors.imu_rate, self.inertial, 2_000_000),
            ("/cmd_vel", sensors.command_rate, self.command, 0),
            ("/camera/color/camera_info", sensors.camera_rate, self.calibration, 20_000_000),
            ("/camera/color/image_raw/compressed", sensors.camera_rate, self.picture, 21_000_000),
            ("/velodyne_points", sensors.lidar_rate, self.cloud, 60_000_000),
        ]
        events = sorted(
            (step, order)
            for order, (_, rate, _, _) in enumerate(makers)
            for step in range(0, len(self.driven.time_s), round(1 / rate / STEP_S))
        )
        for step, order in events:
            topic, _, make, delay_ns = makers[order]
            stamp_ns = START_NS + round(self.driven.time_s[step] * SECOND)
            yield topic, make(step, stamp_ns), stamp_ns, delay_ns

    def mounting(self) -> Any:
        """Where camera and lidar sit."""
        edges = [("camera_optical", CAMERA), ("velodyne", LIDAR)]
        transforms = [self._edge("base_link", child, transform) for child, transform in edges]
        return self.types["TFMessage"](transforms=transforms)

    def odometry(self, step: int, stamp_ns: int) -> Any:
        """The pose and velocity at a step."""
        t = self.types
        x, y, yaw = self.driven.pose[step]
        v, omega = self.driven.velocity[step]
        pose = t["Pose"](
            position=t["Point"](x=x, y=y, z=BASE_HEIGHT),
            orientation=t["Quaternion"](x=0.0, y=0.0, z=np.sin(yaw / 2), w=np.cos(yaw / 2)),
        )
        return t["Odometry"](
            header=self._header(stamp_ns, "odom"),
            child_frame_id="base_link",
            pose=t["PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
            twist=t["TwistWithCovariance"](twist=self._twist(v, omega), covariance=np.zeros(36)),
        )

    def inertial(self, step: int, stamp_ns: int) -> Any:
        """What the IMU measures at a step."""
        t = self.types
        shaken = self.driven.acceleration[step] + self.generator.normal(0, 0.15, 3)
        return t["Imu"](
            header=self._header(stamp_ns, "base_link"),
            orientation=t["Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=np.zeros(9),
            angular_velocity=t["Vector3"](x=0.0, y=0.0, z=self.driven.velocity[step, 1]),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=t["Vector3"](x=shaken[0], y=shaken[1], z=shaken[2]),
            linear_acceleration_covariance=np.zeros(9),
        )

    def command(self, step: int, stamp_ns: int) -> Any:
        """The command at a step."""
        del stamp_ns
        return self._twist(*self.driven.command[step])

    def calibration(self, step: int, stamp_ns: int) -> Any:
        """The camera's calibration."""
        del step
        sensors, f = self.sensors, self.sensors.focal_length
        cx, cy = (sensors.width - 1) / 2, (sensors.height - 1) / 2
        return self.types["CameraInfo"](
            header=self._header(stamp_ns, "camera_optical"),
            height=sensors.height,
            width=sensors.width,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=np.array([f, 0, cx, 0, f, cy, 0, 0, 1.0]),
            r=np.eye(3).ravel(),
            p=np.array([f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1.0, 0]),
            binning_x=0,
            binning_y=0,
            roi=self.types["RegionOfInterest"](
                x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
            ),
        )

    def picture(self, step: int, stamp_ns: int) -> Any:
        """The picture at a step, as JPEG."""
        rgb = _render(
            self.world, self._pose(step) @ CAMERA, self.pixels, self.sensors, self.generator
        )
        encoded = cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 90])[1]
        return self.types["CompressedImage"](
            header=self._header(stamp_ns, "camera_optical"), format="jpeg", data=encoded.ravel()
        )

    def cloud(self, step: int, stamp_ns: int) -> Any:
        """One turn of the lidar, as its driver publishes it."""
        points = _scan(self.world, self._pose(step) @ LIDAR, self.beams, self.generator)
        fields = [
            self.types["PointField"](name=name, offset=offset, datatype=kind, count=1)
            for name, offset, kind in POINT_FIELDS
        ]
        return self.types["PointCloud2"](
            header=self._header(stamp_ns, "velodyne"),
            height=1,
            width=len(points),
            fields=fields,
            is_bigendian=False,
            point_step=POINT_TYPE.itemsize,
            row_step=points.nbytes,
            data=points.view(np.uint8).ravel(),
            is_dense=True,
        )

    def _pose(self, step: int) -> Transform:
        x, y, yaw = self.driven.pose[step]
        return Transform(rotation_from_rpy(0.0, 0.0, yaw), np.array([x, y, BASE_HEIGHT]))

    def _edge(self, parent: str, child: str, transform: Transform) -> Any:
        t = self.types
        x, y, z = transform.translation
        w, (a, b, c) = _quaternion(transform.rotation)
        return t["TransformStamped"](
            header=self._header(START_NS, parent),
            child_frame_id=child,
            transform=t["Transform"](
                translation=t["Vector3"](x=x, y=y, z=z),
                rotation=t["Quaternion"](x=a, y=b, z=c, w=w),
            ),
        )

    def _twist(self, v: float, omega: float) -> Any:
        vector = self.types["Vector3"]
        return self.types["Twist"](
            linear=vector(x=float(v), y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=float(omega))
        )

    def _header(self, stamp_ns: int, frame: str) -> Any:
        seconds, nanoseconds = divmod(stamp_ns, SECOND)
        stamp = self.types["Time"](sec=seconds, nanosec=nanoseconds)
        return self.types["Header"](stamp=stamp, frame_id=frame)


def _quaternion(rotation: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    w = 0.5 * float(np.sqrt(max(1e-12, 1.0 + np.trace(rotation))))
    skew = rotation - rotation.T
    return w, np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4 * w)


def _pixel_rays(sensors: Sensors) -> NDArray[np.float64]:
    u, v = np.meshgrid(np.arange(sensors.width), np.arange(sensors.height))
    centre = np.array([(sensors.width - 1) / 2, (sensors.height - 1) / 2])
    flat = (np.stack([u.ravel(), v.ravel()], axis=1) - centre) / sensors.focal_length
    rays = np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
    unit: NDArray[np.float64] = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return unit


def _beams() -> NDArray[np.float64]:
    """The directions of a VLP-16 in firing order: azimuth outside, the 16 lasers inside."""
    azimuth = np.repeat(np.linspace(np.pi, -np.pi, COLUMNS, endpoint=False), RINGS)
    elevation = np.tile(np.radians(np.arange(-15.0, 16.0, 2.0)), COLUMNS)
    level = np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1)


def _render(
    world: World,
    camera: Transform,
    pixels: NDArray[np.float64],
    sensors: Sensors,
    generator: np.random.Generator,
) -> NDArray[np.uint8]:
    directions = pixels @ camera.rotation.T
    hits = cast_rays(world, camera.translation, directions, generator)
    reach = np.where(np.isfinite(hits.distance), hits.distance, 0.0)
    points = camera.translation + directions * reach[:, None]
    grey = 0.55 + 0.75 * surface_noise(points, (0.08, 0.35, 1.4))
    grey[hits.material == SKY] = 1.0
    colour = np.array([COLOURS[code] for code in range(len(COLOURS))], np.float64)[hits.material]
    lit = colour * grey[:, None] * sensors.light
    noisy = lit + generator.normal(0, 1.5, lit.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8).reshape(sensors.height, sensors.width, 3)


def _scan(
    world: World,
    lidar: Transform,
    beams: NDArray[np.float64],
    generator: np.random.Generator,
) -> NDArray[np.void]:
    hits = cast_rays(world, lidar.translation, beams @ lidar.rotation.T, generator)
    noise = generator.normal(0, 0.01, len(beams))
    seen = hits.distance < LIDAR_REACH
    xyz = beams[seen] * (hits.distance + noise)[seen, None]
    points = np.zeros(len(xyz), POINT_TYPE)
    points["x"], points["y"], points["z"] = xyz.T
    strength = np.array([REFLECTIVITY[code] for code in range(len(REFLECTIVITY))])[hits.material]
    points["intensity"] = np.clip(strength + generator.normal(0, 8, len(beams)), 1, 255)[seen]
    points["ring"] = np.tile(np.arange(RINGS), COLUMNS)[seen]
    points["time"] = np.repeat(np.linspace(0, 0.1, COLUMNS, endpoint=False), RINGS)[seen]
    return points
