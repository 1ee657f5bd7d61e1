"""From what the sensors gave to what a model takes, by ``graspe_data.observation`` alone."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.bundle_contract import BundleContract
from graspe_data.calibration import Calibration
from graspe_data.errors import PlannerError
from graspe_data.observation.observe import observe
from graspe_data.observation.point_sample import row_seed
from graspe_data.observation.trajectory import PredictedTrajectory
from graspe_data.observation.undistortion import rectifier
from graspe_data.robot import Intrinsics
from planners.lidar_clouds import LidarClouds
from planners.motion_history import motion_history
from planners.sensor_frame import SensorFrame
from planners.situation import Situation

KEPT = 256
"""Images; more than a planner's lattice has."""


class DrawnTrajectories:
    """Draws trajectories, and keeps the latest: a lattice asks for the same ones every time."""

    def __init__(self, drawing: PredictedTrajectory) -> None:
        """Take what draws them."""
        self._drawing = drawing
        self._images: OrderedDict[tuple[float, float], NDArray[np.uint8]] = OrderedDict()

    def draw(self, velocities: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Trajectory images, bool (K, H, W), of velocities (K, 2) in m/s and rad/s."""
        size = (self._drawing.intrinsics.height, self._drawing.intrinsics.width)
        images = np.empty((len(velocities), *size), np.bool_)
        for row, (v, omega) in enumerate(velocities.tolist()):
            images[row] = self._image(v, omega)
        return images

    def _image(self, v: float, omega: float) -> NDArray[np.bool_]:
        packed = self._images.pop((v, omega), None)
        if packed is None:
            packed = np.packbits(self._drawing.draw(v, omega), axis=-1)
        self._images[v, omega] = packed
        if len(self._images) > KEPT:
            self._images.popitem(last=False)
        width = self._drawing.intrinsics.width
        return np.unpackbits(packed, axis=-1, count=width).view(np.bool_)


@dataclass(frozen=True)
class ObservedRow:
    """One observation.

    ``columns``: the columns of a row, each with a leading axis of 1: image, points, point_count,
    laser_scan, velocity_history, r_img, r_point. ``r_img`` and ``r_point``: as computed, before
    they are rounded to float32.
    """

    columns: Mapping[str, NDArray[np.generic]]
    r_img: float
    r_point: float

    @property
    def laser_scan(self) -> NDArray[np.float32]:
        """Of the full cloud, float32 (rays,), metres; see ``laser_scan``."""
        return np.asarray(self.columns["laser_scan"][0], np.float32)


class RowObserver:
    """Derives observations for one bundle on one robot."""

    def __init__(
        self, contract: BundleContract, calibration: Calibration, source: str = ""
    ) -> None:
        """Prepare the camera.

        Args:
            contract: How the inputs are derived.
            calibration: Of the robot.
            source: Seeds the sampling of points together with the cloud's stamp. With a
                recording's digest, the points drawn are those of its rows in a dataset of seed 0.

        Raises:
            ObservationError: The camera's distortion is not understood.
        """
        self._settings, self._calibration, self._source = contract.observation, calibration, source
        height, width = contract.observation.picture_size
        self._rectifier = rectifier(calibration.intrinsics, (width, height))
        drawing = PredictedTrajectory(
            intrinsics=self._rectifier.intrinsics,
            base_from_camera=calibration.base_from_camera,
            base_height=contract.robot.base_height,
            line_width=contract.robot.footprint.width,
            steps=contract.observation.horizon_steps,
            step_s=contract.observation.horizon_step_s,
            behind=contract.observation.drawn_from_behind,
        )
        self._trajectories = DrawnTrajectories(drawing)
        frames = calibration.camera_frame, calibration.lidar_frame
        trained = contract.robot.camera_frame, contract.robot.lidar_frame
        camera, lidar = (here or there for here, there in zip(frames, trained, strict=True))
        self._frame = SensorFrame("camera", camera)
        self._clouds = LidarClouds(lidar, contract.observation.points.rings)

    @property
    def camera(self) -> Intrinsics:
        """Of the picture as the model sees it, without distortion."""
        return self._rectifier.intrinsics

    def observe(self, situation: Situation) -> ObservedRow:
        """The observation at the moment of the latest picture, as a row of the dataset has it.

        Raises:
            PlannerError: There is no picture or no cloud, or it is not the calibrated sensor's; or
                the motions do not cover the history.
            ObservationError: The picture is not of the calibrated size, or the cloud's rings are
                damaged.
        """
        picture = situation.picture
        if picture is None or situation.cloud is None:
            missing = "picture" if picture is None else "cloud"
            raise PlannerError(f"no {missing}: the model needs the latest one.")
        history = self.history(situation)
        self._frame.check(picture.frame, situation.motions)
        mounting, least = self._calibration.base_from_lidar, self._settings.points.minimum_range
        cloud = self._clouds.cloud(situation, mounting, least)
        found = observe(
            picture.rgb,
            cloud,
            self._rectifier,
            self._calibration.base_from_lidar,
            self._settings,
            row_seed(0, self._source, cloud.stamp_ns),
        )
        r_img, r_point = found.reliabilities["r_img"], found.reliabilities["r_point"]
        columns: dict[str, NDArray[np.generic]] = {
            "image": found.image,
            "points": found.points.points,
            "point_count": np.array(found.points.point_count, np.int32),
            "laser_scan": found.points.laser_scan,
            "velocity_history": history,
            "r_img": np.array(r_img, np.float32),
            "r_point": np.array(r_point, np.float32),
        }
        return ObservedRow({name: value[None] for name, value in columns.items()}, r_img, r_point)

    def history(self, situation: Situation) -> NDArray[np.float32]:
        """Velocities (H, 2) up to the latest picture; see ``motion_history``.

        Raises:
            PlannerError: There is no picture, or the motions do not cover the history.
            ObservationError: Fewer than two motions are usable.
        """
        if situation.picture is None:
            raise PlannerError("no picture: the model needs the latest one.")
        return motion_history(situation, situation.picture.stamp_ns, self._settings)

    def trajectory_images(self, velocities: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Trajectory images, bool (K, H, W), of velocities (K, 2) in m/s and rad/s."""
        return self._trajectories.draw(velocities)
