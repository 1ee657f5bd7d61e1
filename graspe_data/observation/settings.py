"""The settings of one observation, declared once.

A dataset's manifest states them beside those of the dataset (``ObservationManifest``). What they
come to on one robot (``ObservationSettings``) stands in checkpoints and in bundles, so that a
planner derives the same.
"""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from graspe_data.manifest import Positive, Settings
from graspe_data.observation.image_reliability import ImageReliabilitySettings
from graspe_data.observation.laser_scan import LaserScanSettings
from graspe_data.observation.point_reliability import PointReliabilitySettings
from graspe_data.observation.point_sample import PointSampleSettings
from graspe_data.robot import Robot

Count = Annotated[int, Field(ge=1, le=100_000)]
Behind = Annotated[float, Field(ge=0, le=100)]


class PointObservationSettings(Settings):
    """How a cloud is observed; all from ``rings`` on describe the robot, lengths in metres.

    Returns nearer than ``minimum_range`` hit the robot, and coordinates beyond ``maximum_range``
    are damage; neither counts.
    """

    neighbours: Annotated[int, Field(gt=0, le=1000)] = 5
    sample: PointSampleSettings = PointSampleSettings()
    laser_scan: LaserScanSettings = LaserScanSettings()
    rings: Annotated[int, Field(ge=1, le=256)] | None = None
    intensity_maximum: Annotated[float, Field(gt=0)] = 255.0
    minimum_range: Annotated[float, Field(ge=0)] = 0.0
    maximum_range: Annotated[float, Field(gt=0, le=1e6)] = 1000.0
    base_height: float = 0.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        near, far = self.minimum_range, self.maximum_range
        if near > far:
            raise ValueError(f"minimum_range {near} is above maximum_range {far}")
        return self


class HistorySettings(Settings):
    """The velocity history, and how far apart in time the sensors of one observation may be.

    Attributes:
        history_steps: Velocities of the history, the last of them now.
        history_step_s: Time between them.
        odometry_gap_s: Velocities are not interpolated across a longer gap.
        points_tolerance_s: How old a cloud is at most when a picture is taken.
    """

    history_steps: Annotated[int, Field(ge=1, le=10_000)] = 50
    history_step_s: Positive = 0.1
    odometry_gap_s: Positive = 0.25
    points_tolerance_s: Annotated[float, Field(ge=0)] = 0.1


class HorizonSettings(Settings):
    """The constant-velocity arc that a row is about."""

    steps: Annotated[int, Field(ge=1, le=1000)] = 10
    step_s: Positive = 0.3


class TrajectoryImageSettings(Settings):
    """How the arc is drawn."""

    behind: Behind = 0.0
    """Metres behind the robot's camera from which it is seen; 0 as the camera itself sees it."""


class ImageSettings(Settings):
    """The size of the stored picture."""

    width: Annotated[int, Field(ge=16, le=4096)] = 320
    height: Annotated[int, Field(ge=16, le=4096)] = 240


class PointSettings(Settings):
    """How a cloud is observed; what the robot decides stands in the robot's manifest."""

    neighbours: Annotated[int, Field(ge=1, le=1000)] = 5
    """Of equation (3), to each side on the ring."""
    sample: PointSampleSettings = PointSampleSettings()
    laser_scan: LaserScanSettings = LaserScanSettings()


class ObservationSettings(HistorySettings):
    """All that is needed to derive an observation from what the sensors of one robot give.

    Every key but ``drawn_from_behind`` has to be there when one is read: a planner does not guess
    what a model was trained with.

    Attributes:
        picture_size: Height and width of the picture and of the trajectory images, pixels.
        points: How a cloud is observed.
        image_reliability: Equations (1) and (2).
        point_reliability: Equations (4) and (5).
        horizon_steps: Steps of the trajectory drawn into the picture.
        horizon_step_s: Time between them.
        drawn_from_behind: Metres behind the robot's camera from which the trajectory is drawn.
    """

    picture_size: tuple[Count, Count]
    points: PointObservationSettings
    image_reliability: ImageReliabilitySettings
    point_reliability: PointReliabilitySettings
    horizon_steps: Count
    horizon_step_s: Positive
    drawn_from_behind: Behind = 0.0

    @property
    def sizes(self) -> dict[str, int]:
        """Sizes of the columns of an observation, by the names that the catalogue uses."""
        height, width = self.picture_size
        return {
            "height": height,
            "width": width,
            "points": self.points.sample.count,
            "rays": self.points.laser_scan.rays,
            "history": self.history_steps,
            "horizon": self.horizon_steps,
        }

    @model_validator(mode="after")
    def _history_is_told(self) -> Self:
        if missing := sorted(HistorySettings.model_fields.keys() - self.model_fields_set):
            raise ValueError(f"{', '.join(missing)}: missing")
        return self


class ObservationManifest(Settings):
    """What a dataset's manifest says of its observations. The defaults are the paper's."""

    window: HistorySettings = HistorySettings()
    horizon: HorizonSettings = HorizonSettings()
    trajectory_image: TrajectoryImageSettings = TrajectoryImageSettings()
    image: ImageSettings = ImageSettings()
    points: PointSettings = PointSettings()
    image_reliability: ImageReliabilitySettings = ImageReliabilitySettings()
    point_reliability: PointReliabilitySettings = PointReliabilitySettings()

    def on_robot(self, robot: Robot) -> ObservationSettings:
        """What it comes to on a robot."""
        history = {name: getattr(self.window, name) for name in HistorySettings.model_fields}
        return ObservationSettings(
            picture_size=(self.image.height, self.image.width),
            points=self._points(robot),
            image_reliability=self.image_reliability,
            point_reliability=self.point_reliability,
            horizon_steps=self.horizon.steps,
            horizon_step_s=self.horizon.step_s,
            drawn_from_behind=self.trajectory_image.behind,
            **history,
        )

    def _points(self, robot: Robot) -> PointObservationSettings:
        return PointObservationSettings(
            neighbours=self.points.neighbours,
            sample=self.points.sample,
            laser_scan=self.points.laser_scan,
            rings=robot.lidar.rings,
            intensity_maximum=robot.lidar.intensity_maximum,
            minimum_range=robot.lidar.minimum_range,
            base_height=robot.base_height,
        )
