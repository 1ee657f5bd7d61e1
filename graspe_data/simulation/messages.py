"""ROS 2 messages of a simulated robot, built from arrays."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform
from graspe_data.recordings.message_types import message_classes
from graspe_data.robot import Intrinsics, Robot
from graspe_data.simulation.quaternion import quaternion_from_rotation

SECOND = 1_000_000_000
POINT_KINDS = {"f4": 7, "u2": 4}


class Messages:
    """Builds messages with the frames of a robot; stamps are int64 ns."""

    def __init__(self, robot: Robot) -> None:
        """Take the frames' names; where the manifest leaves a sensor's open, a usual one."""
        self.base, self.odom = robot.base_frame, robot.odometry_frame
        self.camera = robot.camera.frame or "camera_optical"
        self.lidar = robot.lidar.frame or "velodyne"

    @cached_property
    def _types(self) -> Any:
        return {name.split("/")[-1]: kind for name, kind in message_classes().items()}

    def odometry(self, stamp_ns: int, pose: Transform, v: float, omega: float) -> Any:
        """Pose of the base in the odometry's frame, and velocities in m/s and rad/s."""
        t = self._types
        x, y, z = pose.translation
        placed = t["Pose"](
            position=t["Point"](x=x, y=y, z=z), orientation=self._quaternion(pose.rotation)
        )
        return t["Odometry"](
            header=self._header(stamp_ns, self.odom),
            child_frame_id=self.base,
            pose=t["PoseWithCovariance"](pose=placed, covariance=np.zeros(36)),
            twist=t["TwistWithCovariance"](twist=self.twist(v, omega), covariance=np.zeros(36)),
        )

    def twist(self, v: float, omega: float) -> Any:
        """A velocity in m/s and rad/s."""
        forward, turn = np.array([v, 0.0, 0.0]), np.array([0.0, 0.0, omega])
        return self._types["Twist"](linear=self._vector(forward), angular=self._vector(turn))

    def inertial(self, stamp_ns: int, acceleration: Floats, gyro: Floats) -> Any:
        """Acceleration (3,) with gravity in m/s^2, rates (3,) in rad/s; no orientation."""
        return self._types["Imu"](
            header=self._header(stamp_ns, self.base),
            orientation=self._quaternion(np.eye(3)),
            orientation_covariance=np.array([-1.0, *[0.0] * 8]),
            angular_velocity=self._vector(gyro),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self._vector(acceleration),
            linear_acceleration_covariance=np.zeros(9),
        )

    def calibration(self, stamp_ns: int, camera: Intrinsics) -> Any:
        """The calibration of a camera without distortion."""
        t = self._types
        return t["CameraInfo"](
            header=self._header(stamp_ns, self.camera),
            height=camera.height,
            width=camera.width,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=camera.matrix.ravel(),
            r=np.eye(3).ravel(),
            p=np.concatenate([camera.matrix, np.zeros((3, 1))], axis=1).ravel(),
            binning_x=0,
            binning_y=0,
            roi=t["RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
        )

    def picture(self, stamp_ns: int, jpeg: bytes) -> Any:
        """A picture that is JPEG already."""
        return self._types["CompressedImage"](
            header=self._header(stamp_ns, self.camera),
            format="jpeg",
            data=np.frombuffer(jpeg, np.uint8),
        )

    def cloud(self, stamp_ns: int, points: NDArray[np.void]) -> Any:
        """Points (N,) of a structured dtype, as they lie in memory."""
        layout: Mapping[str, Any] = points.dtype.fields or {}
        fields = [
            self._types["PointField"](
                name=name, offset=place[1], datatype=POINT_KINDS[place[0].str[1:]], count=1
            )
            for name, place in layout.items()
        ]
        return self._types["PointCloud2"](
            header=self._header(stamp_ns, self.lidar),
            height=1,
            width=len(points),
            fields=fields,
            is_bigendian=False,
            point_step=points.dtype.itemsize,
            row_step=points.nbytes,
            data=np.ascontiguousarray(points).view(np.uint8).ravel(),
            is_dense=True,
        )

    def transforms(self, stamp_ns: int, edges: dict[tuple[str, str], Transform]) -> Any:
        """Edges (parent, child) of the tree of frames."""
        t = self._types
        stamped = [
            t["TransformStamped"](
                header=self._header(stamp_ns, parent),
                child_frame_id=child,
                transform=t["Transform"](
                    translation=self._vector(edge.translation),
                    rotation=self._quaternion(edge.rotation),
                ),
            )
            for (parent, child), edge in edges.items()
        ]
        return t["TFMessage"](transforms=stamped)

    def text(self, content: str) -> Any:
        """A text."""
        return self._types["String"](data=content)

    def _vector(self, values: Floats) -> Any:
        x, y, z = values
        return self._types["Vector3"](x=float(x), y=float(y), z=float(z))

    def _quaternion(self, rotation: Floats) -> Any:
        x, y, z, w = quaternion_from_rotation(rotation).tolist()
        return self._types["Quaternion"](x=x, y=y, z=z, w=w)

    def _header(self, stamp_ns: int, frame: str) -> Any:
        seconds, nanoseconds = divmod(stamp_ns, SECOND)
        stamp = self._types["Time"](sec=seconds, nanosec=nanoseconds)
        return self._types["Header"](stamp=stamp, frame_id=frame)
