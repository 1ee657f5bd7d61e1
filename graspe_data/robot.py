"""The robot manifest: topics, camera, lidar, mounting, limits, footprint."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.manifest import Positive, Settings, find_manifest, load_manifest

BY_LIDAR: Final = "lidar"

Vector3 = tuple[float, float, float]
LidarModel = Literal[
    "VLP-16",
    "VLP-32C",
    "Pandar40P",
    "Pandar64",
    "Pandar128",
    "PandarQT64",
    "PandarQT128",
    "PandarXT16",
    "PandarXT32",
    "PandarXT32M",
    "generic",
]


class Topics(Settings):
    """Which topic serves as what."""

    image: str
    points: str
    odometry: str
    """``lidar`` where it is made from the clouds, see ``Robot.odometry``."""
    camera_info: str | None = None
    command: str | None = None
    imu: str | None = None

    @model_validator(mode="after")
    def _one_role_each(self) -> Self:
        roles: dict[str, str] = {}
        for role, topic in self:
            if topic is not None and topic in roles:
                raise ValueError(f"{topic} is named as both {roles[topic]} and {role}")
            roles[topic] = role
        return self


class Clock(Settings):
    """How a topic's stamps become time.

    ``offset_s`` is added to the topic's stamps; ``measured`` estimates it from the difference
    between the topic's least skew and the camera's, and is refused where that is not constant.
    ``latency_s`` is then taken off: how much longer than a picture a message of this sensor needs,
    at the least, from its stamp to the recorder.
    """

    stamp: Literal["header", "bag"] = "header"
    offset_s: float | Literal["measured"] = 0.0
    latency_s: Annotated[float, Field(ge=0, le=10)] = 0.0


class Clocks(Settings):
    """The clock of each sensor."""

    image: Clock = Clock()
    points: Clock = Clock()
    odometry: Clock = Clock()
    command: Clock = Clock()
    imu: Clock = Clock()


class Intrinsics(Settings):
    """A calibrated pinhole camera; pixels, OpenCV's distortion models."""

    width: Annotated[int, Field(gt=0, le=16384)]
    height: Annotated[int, Field(gt=0, le=16384)]
    fx: Positive
    fy: Positive
    cx: float
    cy: float
    distortion_model: Literal["none", "plumb_bob", "rational_polynomial", "equidistant"] = "none"
    distortion: tuple[float, ...] = ()

    @property
    def matrix(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """The camera matrix (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


class Mounting(Settings):
    """Where a sensor sits in base_link: metres, and roll, pitch, yaw in rad."""

    translation: Vector3
    rotation_rpy: Vector3 = (0.0, 0.0, 0.0)

    @property
    def transform(self) -> Transform:
        """The transform that carries points of the sensor into base_link."""
        return Transform(rotation_from_rpy(*self.rotation_rpy), np.asarray(self.translation))


class Camera(Settings):
    """The camera: its calibration and mounting, each given here or taken from the recording."""

    intrinsics: Intrinsics | Literal["camera_info"] = "camera_info"
    mounting: Mounting | Literal["tf"] = "tf"
    frame: str | None = None
    """Optical frame; None takes it from the images' headers."""
    rectified: bool = False
    """The pictures are rectified already: of CameraInfo, P counts, and no distortion."""


class Lidar(Settings):
    """The lidar: its model, mounting, scale of intensity and number of rings."""

    model: LidarModel = "generic"
    """Needed for packets alone, and there it is checked; ``generic`` takes what the packets say."""
    angles: str | None = None
    """File of the angles of a Hesai lidar's channels (CSV: Laser id,Elevation,Azimuth), looked for
    beside the manifest; None takes the nominal ones where the model has some."""
    mounting: Mounting | Literal["tf"] = "tf"
    frame: str | None = None
    """None takes it from the clouds' headers."""
    rings: Annotated[int, Field(ge=1, le=256)] | None = None
    """None recovers the number of rings from the cloud where it has no ring field."""
    intensity_field: str | None = None
    """Field of PointCloud2 that tells how strong a return is: ``reflectivity`` of an Ouster. None
    takes the first present of intensity, intensities, i and reflectivity."""
    intensity_maximum: Positive = 255.0
    minimum_range: Annotated[float, Field(ge=0, le=1000)] = 0.0


class Limits(Settings):
    """Velocity and acceleration limits: m/s, rad/s, m/s^2, rad/s^2."""

    linear_velocity: tuple[float, float]
    yaw_rate: tuple[float, float]
    linear_acceleration: Positive = 1.0
    yaw_acceleration: Positive = 3.2

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in ("linear_velocity", "yaw_rate"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: the lower limit {low} is above the upper limit {high}")
        return self


class Footprint(Settings):
    """The robot on the ground, metres; ``width`` is also the width of the drawn trajectory."""

    length: Positive
    width: Positive


TopicName = Annotated[str, Field(pattern=r"^(/[A-Za-z0-9_~]+)+$", max_length=255)]
TypeName = Annotated[str, Field(pattern=r"^\w+(/msg)?/\w+$", max_length=255)]


class Recognition(Settings):
    """What tells a recording of this robot from others: topics with their types, and frames."""

    topics: Annotated[dict[TopicName, TypeName], Field(min_length=1, max_length=64)]
    """Without a robot's own name in front: it is recognised under any namespace."""
    frames: tuple[str, ...] = ()


class Robot(Settings):
    """A robot manifest."""

    name: str
    topics: Topics
    base_frame: str = "base_link"
    odometry_frame: str = "odom"
    odometry: Literal["topic", "lidar"] = "topic"
    """``lidar`` makes odometry from the clouds by KISS-ICP, for recordings that have none;
    ``topics.odometry`` is then left out."""
    odometry_velocity: Literal["checked", "body", "fixed", "differentiated"] = "checked"
    """What velocities are taken from: ``checked`` holds twist and poses against each other and
    decides; ``body`` and ``fixed`` take the twist as given in the body's or in the odometry frame;
    ``differentiated`` takes them from the poses."""
    base_height: float = 0.0
    """Height of base_link above the ground, metres: the ground is the plane z = -base_height."""
    camera: Camera = Camera()
    lidar: Lidar = Lidar()
    clocks: Clocks = Clocks()
    limits: Limits
    footprint: Footprint
    recognised_by: Recognition | None = None
    """By what ``graspe inspect`` suggests this manifest; None: by ``topics`` alone."""

    @model_validator(mode="before")
    @classmethod
    def _odometry_by_lidar(cls, content: Any) -> Any:
        """``odometry: lidar`` and ``topics: {odometry: lidar}`` say the same."""
        topics = content.get("topics") if isinstance(content, dict) else None
        if not isinstance(topics, dict):
            return content
        if BY_LIDAR not in (content.get("odometry"), topics.get("odometry")):
            return content
        if topics.get("odometry") not in (None, BY_LIDAR):
            raise ValueError(
                f"odometry: lidar makes it from the clouds, and topics.odometry names "
                f"{topics['odometry']}: leave one of them out"
            )
        return {**content, "odometry": BY_LIDAR, "topics": {**topics, "odometry": BY_LIDAR}}

    @property
    def by_lidar(self) -> bool:
        """Whether odometry is made from the clouds."""
        return self.odometry == BY_LIDAR


def load_robot(name: str | Path) -> Robot:
    """Load a robot manifest; a file of angles is looked for beside it.

    Args:
        name: Its path, or the name of one that ships.

    Raises:
        ManifestError: The manifest is missing or does not validate.
    """
    path = find_manifest("robots", name)
    robot = load_manifest(path, Robot)
    if robot.lidar.angles is None:
        return robot
    angles = str(path.resolve().parent / robot.lidar.angles)
    return robot.model_copy(update={"lidar": robot.lidar.model_copy(update={"angles": angles})})
