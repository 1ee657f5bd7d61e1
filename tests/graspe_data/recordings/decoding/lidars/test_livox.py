from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from graspe_data.errors import RecordingError
from graspe_data.inspection.roles import roles_of
from graspe_data.recordings import RecordingWriter, open_recording
from graspe_data.recordings.decoding import cloud_decoder
from graspe_data.recordings.message_types import message_classes

TYPES = ["livox_ros_driver/msg/CustomMsg", "livox_ros_driver2/msg/CustomMsg"]


def point(x: float, tag: int = 0, line: int = 0, reflectivity: int = 100) -> Any:
    return SimpleNamespace(
        offset_time=0, x=x, y=0.5, z=-0.25, reflectivity=reflectivity, tag=tag, line=line
    )


def message(build: Any, *points: Any) -> Any:
    return SimpleNamespace(header=build.header("livox"), point_num=len(points), points=points)


@pytest.mark.parametrize("kind", TYPES)
def test_a_point_keeps_its_line_and_reflectivity(build: Any, kind: str) -> None:
    said = message(build, point(1.5, 16, 3, 255), point(2.5, 0, 1, 0))
    cloud = cloud_decoder(kind, "/livox/lidar", "generic")(said)
    assert cloud.xyz.tolist() == [[1.5, 0.5, -0.25], [2.5, 0.5, -0.25]]
    assert cloud.ring is not None
    assert cloud.intensity is not None
    assert (cloud.ring.tolist(), cloud.intensity.tolist()) == ([3, 1], [255.0, 0.0])
    assert (cloud.stamp_ns, cloud.frame) == (12_000_000_034, "livox")


@pytest.mark.parametrize(
    ("tag", "kept"),
    [
        (0b00000000, True),
        (0b00010000, True),  # first return
        (0b00100000, True),  # second return
        (0b00000001, False),  # surest noise by place
        (0b00000010, True),
        (0b00000011, True),
        (0b00000100, False),  # surest noise by intensity
        (0b00001000, True),
        (0b00010001, False),
        (0b00010100, False),
        (0b11000000, True),
    ],
)
def test_only_the_surest_noise_is_dropped(build_ros2: Any, tag: int, kept: bool) -> None:
    cloud = cloud_decoder(TYPES[1], "/l", "generic")(message(build_ros2, point(1.0, tag)))
    assert len(cloud.xyz) == kept


def test_what_did_not_return_is_dropped(build_ros2: Any) -> None:
    nothing = SimpleNamespace(x=0.0, y=0.0, z=0.0, reflectivity=0, tag=0, line=0)
    said = message(build_ros2, nothing, point(np.nan), point(np.inf), point(3.0))
    assert cloud_decoder(TYPES[0], "/l", "generic")(said).xyz.tolist() == [[3.0, 0.5, -0.25]]


def test_a_message_without_points_is_an_empty_cloud(build_ros2: Any) -> None:
    cloud = cloud_decoder(TYPES[0], "/l", "generic")(message(build_ros2))
    assert cloud.xyz.shape == (0, 3)


def test_a_wrong_number_of_points_is_refused(build_ros2: Any) -> None:
    said = message(build_ros2, point(1.0))
    said.point_num = 2
    with pytest.raises(RecordingError, match="point_num is 2, but there are 1"):
        cloud_decoder(TYPES[0], "/l", "generic")(said)


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("container", ["bag", "mcap", "db3"])
def test_such_a_topic_serves_as_points_from_any_container(
    tmp_path: Path, kind: str, container: Any
) -> None:
    classes: Any = message_classes()
    stamp = classes["builtin_interfaces/msg/Time"](5, 7)
    one = classes[kind.replace("CustomMsg", "CustomPoint")](9, 1.0, 2.0, 3.0, 80, 16, 2)
    said = classes[kind](
        classes["std_msgs/msg/Header"](stamp, "livox"), 0, 1, 0, np.zeros(3, np.uint8), [one]
    )
    path = tmp_path / ("drive.bag" if container == "bag" else "drive")
    with RecordingWriter(path, container) as writer:
        writer.write("/livox/lidar", said, 10)
    with open_recording(path) as recording:
        raw = next(iter(recording.messages()))
        cloud = cloud_decoder(recording.topics[raw.topic].message_type, raw.topic, "generic")(
            recording.decode(raw)
        )
    assert cloud.xyz.tolist() == [[1.0, 2.0, 3.0]]
    assert (cloud.stamp_ns, roles_of("/livox/lidar", kind)) == (5_000_000_007, ("points",))
