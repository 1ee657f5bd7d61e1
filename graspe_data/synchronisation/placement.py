"""Where sensors are on the robot: mountings by the manifest or tf, at the time of each message."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from graspe_data.arrays import Mask, Stamps
from graspe_data.calibration import Sensor, declared_mounting
from graspe_data.errors import GeometryError, RecordingError
from graspe_data.geometry import Transform, move_points, plain_frame
from graspe_data.robot import Robot
from graspe_data.sensor_data import PointCloud
from graspe_data.synchronisation.findings import Finding
from graspe_data.synchronisation.transform_buffer import TransformBuffer

_APART_M, _TURNED_RAD = 0.05, 0.1


@dataclass(frozen=True)
class PlacedCloud:
    """A cloud in the lidar's frame, and the transform that carries its points into the base."""

    cloud: PointCloud
    base_from_lidar: Transform


@dataclass(frozen=True)
class Placement:
    """Places the sensors of one robot by its manifest and a recording's transforms."""

    robot: Robot
    transforms: TransformBuffer

    def place_cloud(self, cloud: PointCloud, stamp_ns: int) -> PlacedCloud:
        """Bring a cloud into the lidar's frame, from whichever frame it was published in.

        Args:
            cloud: As decoded.
            stamp_ns: Its time on the axis of the transforms.

        Raises:
            GeometryError: The frames do not connect, or not at that time.
        """
        mounting, frame = self._lidar_at(cloud.frame, stamp_ns), plain_frame(cloud.frame)
        if not self.carried(frame):
            return PlacedCloud(cloud, mounting)
        base = self.robot.base_frame
        moved = mounting.inverse() @ self.transforms.lookup(base, frame, stamp_ns)
        return PlacedCloud(replace(cloud, xyz=move_points(cloud.xyz, moved)), mounting)

    def carried(self, frame: str) -> bool:
        """Whether clouds of a frame are carried into the lidar's: those of no sensor's own frame.

        These are the base frame, and every frame that moves against it, as the odometry frame does.
        """
        base, frame = self.robot.base_frame, plain_frame(frame)
        if frame == base:
            return True
        return self.transforms.connects(base, frame) and not self.transforms.is_fixed(base, frame)

    def known(self, frame: str, stamps_ns: Stamps) -> Mask:
        """At which times clouds of a frame can be placed, bool (N,)."""
        if not self.carried(frame):
            return np.ones(stamps_ns.size, np.bool_)
        return self.transforms.poses(self.robot.base_frame, plain_frame(frame), stamps_ns).known

    def camera_mountings(self, frame: str) -> list[tuple[int, Transform]]:
        """The camera's mountings in the base, each with the time from which it counts.

        Raises:
            RecordingError: The camera's frame moves against the base.
            GeometryError: The frames do not connect.
        """
        declared = declared_mounting(self.robot, "camera")
        if declared is not None:
            return [(np.iinfo(np.int64).min, declared)]
        base, frame = self.robot.base_frame, plain_frame(self.robot.camera.frame or frame)
        if not self.transforms.is_fixed(base, frame):
            raise RecordingError(
                f"the camera's frame {frame!r} moves against {base!r}, so no picture shows where "
                f"the robot would drive. Set `camera.frame` to the camera's own frame, or give "
                f"`camera.mounting`."
            )
        return self.transforms.changes(base, frame)

    def check(self, image_frame: str, points_frame: str) -> None:
        """Make sure that the sensors' frames lead to the base.

        Raises:
            RecordingError: One does not, or the camera moves against the base.
        """
        base = self.robot.base_frame
        try:
            self.camera_mountings(image_frame)
            if declared_mounting(self.robot, "lidar") is None:
                self.transforms.path(base, self.robot.lidar.frame or points_frame)
        except GeometryError as error:
            raise RecordingError(str(error)) from error

    def findings(self, image_frame: str, points_frame: str) -> list[Finding]:
        """What the manifest and tf say differently, and what changed in mid-run."""
        found = [
            self._sensor_finding("camera", self.robot.camera.frame or image_frame),
            self._sensor_finding("lidar", self.robot.lidar.frame or points_frame),
        ]
        findings = [finding for finding in found if finding is not None]
        if self.carried(points_frame):
            findings.append(self._carried_finding(plain_frame(points_frame)))
        return findings

    def _lidar_at(self, cloud_frame: str, stamp_ns: int) -> Transform:
        lidar, base = self.robot.lidar, self.robot.base_frame
        declared = declared_mounting(self.robot, "lidar")
        if declared is not None:
            return declared
        frame = lidar.frame or ("" if self.carried(cloud_frame) else cloud_frame)
        if not frame and plain_frame(cloud_frame):
            return Transform.identity()
        return self.transforms.lookup(base, frame, stamp_ns)

    def _carried_finding(self, frame: str) -> Finding:
        base, lidar = self.robot.base_frame, self.robot.lidar
        own = declared_mounting(self.robot, "lidar") is not None or lidar.frame is not None
        into = "the lidar's frame" if own else base
        how = "" if frame == base else ", by the pose at their stamps"
        text = f"clouds come in {frame!r}: they are carried into {into}{how}"
        if not own:
            text += "; give `lidar.mounting` so that rings are looked for around the lidar"
        return Finding("cloud_in_other_frame", "mended", frame, text)

    def _sensor_finding(self, sensor: Sensor, frame: str) -> Finding | None:
        base, frame = self.robot.base_frame, plain_frame(frame)
        try:
            changes = self.transforms.changes(base, frame)
        except GeometryError:
            return None
        declared = declared_mounting(self.robot, sensor)
        if declared is not None:
            return self._declared_finding(sensor, declared, frame, changes[-1][1])
        if len(changes) == 1:
            return None
        before, after = changes[-2][1], changes[-1][1]
        moved = float(np.linalg.norm(after.translation - before.translation))
        text = (
            f"the {sensor}'s frame {frame!r} is set anew in mid-run, {moved:.3f} m away: rows "
            f"before have the old place, rows after it the new one"
        )
        return Finding("mounting_changed", "mended", frame, text, {"moved_m": moved})

    def _declared_finding(
        self, sensor: Sensor, declared: Transform, frame: str, published: Transform
    ) -> Finding | None:
        if self.carried(frame):
            return None
        between = declared.inverse() @ published
        away = float(np.linalg.norm(between.translation))
        turned = float(np.arccos(np.clip((np.trace(between.rotation) - 1) / 2, -1, 1)))
        if away < _APART_M and turned < _TURNED_RAD:
            return None
        text = (
            f"`{sensor}.mounting` and tf's {frame!r} are {away:.2f} m and {turned:.2f} rad apart: "
            f"the manifest counts"
        )
        numbers = {"apart_m": away, "turned_rad": turned}
        return Finding("mounting_differs", "noted", frame, text, numbers)
