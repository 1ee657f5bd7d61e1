"""Clouds as other sensors and drivers lay them out; the points stay where they are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from graspe_data.simulation.habits.message_parts import SECOND, message_class, stamp_of
from graspe_data.simulation.habits.recorded import Habit, changed
from graspe_data.simulation.lidar.beams import POINT_TYPE

POSITIONS: Final[np.dtype[np.void]] = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
"""Spot's drivers: ``ENCODING_XYZ_32F`` and nothing else."""
OUSTER: Final[np.dtype[np.void]] = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "t", "reflectivity", "ring", "noise", "range"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u4", "<u2", "u1", "<u2", "<u4"],
        "offsets": [0, 4, 8, 16, 20, 24, 26, 28, 32],
        "itemsize": 48,
    }
)
"""``ouster_ros`` of the OS1's first firmware: ``t`` in ns, ``range`` in mm."""
LIVOX: Final[np.dtype[np.void]] = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "tag", "line", "timestamp"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "u1", "u1", "<f8"],
        "offsets": [0, 4, 8, 12, 16, 17, 18],
        "itemsize": 26,
    }
)
"""``livox_ros_driver2`` with ``xfer_format 0``: ``timestamp`` in ns."""
_DATATYPE: Final = {"u1": 2, "u2": 4, "u4": 6, "f4": 7, "f8": 8}


def points_of(cloud: Any) -> NDArray[np.void]:
    """The points of a simulated cloud, ``POINT_TYPE`` (N,)."""
    return np.frombuffer(cloud.data.tobytes(), POINT_TYPE)


def laid_out(cloud: Any, points: NDArray[np.void]) -> Any:
    """A cloud of other points (N,) of a structured dtype, with the same header."""
    layout: Mapping[str, Any] = points.dtype.fields or {}
    fields = [
        message_class("sensor_msgs/PointField")(
            name=name, offset=place[1], datatype=_DATATYPE[place[0].str[1:]], count=1
        )
        for name, place in layout.items()
    ]
    return message_class("sensor_msgs/PointCloud2")(
        header=cloud.header,
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=False,
        point_step=points.dtype.itemsize,
        row_step=points.nbytes,
        data=np.frombuffer(points.tobytes(), np.uint8),
        is_dense=True,
    )


def positions_only(topic: str) -> Habit:
    """Clouds of x, y and z alone."""
    return changed(topic, lambda cloud: laid_out(cloud, _shared(points_of(cloud), POSITIONS)))


def ouster_points(topic: str) -> Habit:
    """Clouds in the layout of an Ouster OS1."""

    def change(cloud: Any) -> Any:
        points = points_of(cloud)
        new = _shared(points, OUSTER)
        new["t"], new["reflectivity"] = _after_ns(points), points["intensity"]
        xyz = np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)
        new["range"] = np.rint(1000 * np.linalg.norm(xyz, axis=1))
        return laid_out(cloud, new)

    return changed(topic, change)


def livox_points(topic: str) -> Habit:
    """Livox clouds as PointCloud2."""

    def change(cloud: Any) -> Any:
        points = points_of(cloud)
        new = _shared(points, LIVOX)
        new["line"], new["tag"] = points["ring"], 16
        new["timestamp"] = stamp_of(cloud) + _after_ns(points)
        return laid_out(cloud, new)

    return changed(topic, change)


def livox_messages(topic: str) -> Habit:
    """Livox clouds as ``livox_ros_driver2/CustomMsg``: line for ring, reflectivity for intensity.

    Its stamp is that of the first point, from which the points' offsets count.
    """

    def change(cloud: Any) -> Any:
        points, make = points_of(cloud), message_class("livox_ros_driver2/CustomPoint")
        after = _after_ns(points).tolist()
        made = [
            make(
                offset_time=offset,
                x=float(point["x"]),
                y=float(point["y"]),
                z=float(point["z"]),
                reflectivity=int(point["intensity"]),
                tag=16,
                line=int(point["ring"]),
            )
            for offset, point in zip(after, points, strict=True)
        ]
        return message_class("livox_ros_driver2/CustomMsg")(
            header=cloud.header,
            timebase=stamp_of(cloud),
            point_num=len(made),
            lidar_id=192,
            rsvd=np.zeros(3, np.uint8),
            points=made,
        )

    return changed(topic, change)


def _shared(points: NDArray[np.void], layout: np.dtype[np.void]) -> NDArray[np.void]:
    """Points in another layout: fields of the same name carry over, the others are 0."""
    new = np.zeros(len(points), layout)
    for name in set(layout.names or ()) & set(points.dtype.names or ()):
        new[name] = points[name]
    return new


def _after_ns(points: NDArray[np.void]) -> NDArray[np.int64]:
    return np.rint(points["time"].astype(np.float64) * SECOND).astype(np.int64)
