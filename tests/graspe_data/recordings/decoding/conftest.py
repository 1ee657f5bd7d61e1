"""Messages of both ROS generations, built with the classes that rosbags decodes to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

STORES = {"ros1": Stores.ROS1_NOETIC, "ros2": Stores.ROS2_JAZZY}


class Messages:
    """Builds messages of one generation; the header stamp is 12.000000034 s in frame ``sensor``."""

    def __init__(self, generation: str) -> None:
        self.types = get_typestore(STORES[generation]).types
        self.generation = generation

    def __call__(self, name: str, **fields: Any) -> Any:
        return self.types[name](**fields)

    def header(self, frame: str = "sensor", sec: int = 12, nanosec: int = 34) -> Any:
        sequence = {"seq": 0} if self.generation == "ros1" else {}
        stamp = self("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
        return self("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **sequence)

    def vector(self, *values: float) -> Any:
        return self("geometry_msgs/msg/Vector3", x=values[0], y=values[1], z=values[2])

    def pose(self, position: tuple[float, ...], quaternion: tuple[float, ...]) -> Any:
        keys = ("x", "y", "z", "w")
        return self(
            "geometry_msgs/msg/Pose",
            position=self("geometry_msgs/msg/Point", **dict(zip(keys, position, strict=False))),
            orientation=self(
                "geometry_msgs/msg/Quaternion", **dict(zip(keys, quaternion, strict=True))
            ),
        )

    def twist(self, linear: tuple[float, ...], angular: tuple[float, ...]) -> Any:
        return self(
            "geometry_msgs/msg/Twist", linear=self.vector(*linear), angular=self.vector(*angular)
        )

    def image(
        self, encoding: str, width: int, height: int, data: bytes, step: int, **fields: Any
    ) -> Any:
        return self(
            "sensor_msgs/msg/Image",
            header=self.header(),
            encoding=encoding,
            width=width,
            height=height,
            step=step,
            data=np.frombuffer(data, np.uint8),
            **{"is_bigendian": 0, **fields},
        )

    def compressed(self, data: bytes, form: str = "") -> Any:
        content = np.frombuffer(data, np.uint8)
        kind = "sensor_msgs/msg/CompressedImage"
        return self(kind, header=self.header(), format=form, data=content)

    def cloud(
        self, fields: list[tuple[str, int, int]], data: bytes, step: int, **changes: Any
    ) -> Any:
        field_type = self.types["sensor_msgs/msg/PointField"]
        width = len(data) // step if step else 0
        shape = {"height": 1, "width": width, "row_step": width * step, "is_bigendian": False}
        return self(
            "sensor_msgs/msg/PointCloud2",
            header=self.header(),
            fields=[field_type(name=n, offset=o, datatype=t, count=1) for n, o, t in fields],
            point_step=step,
            data=np.frombuffer(data, np.uint8),
            is_dense=True,
            **{**shape, **changes},
        )


@pytest.fixture(params=["ros1", "ros2"])
def build(request: pytest.FixtureRequest) -> Messages:
    return Messages(request.param)


@pytest.fixture(scope="session")
def build_ros2() -> Messages:
    return Messages("ros2")
