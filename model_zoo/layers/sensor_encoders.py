"""Every sensor's columns to its features: f_vec of GrASPE, section IV-B."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from graspe_data.manifest import Settings
from model_zoo.bounds import Metres, Points, Shrink, Side, Units, Width
from model_zoo.contract import Features, Observation
from model_zoo.layers.pointnet import PointNet, PointNetSettings
from model_zoo.layers.reliability_graph import FeatureCounts
from model_zoo.layers.resnet18 import ResNet18
from model_zoo.layers.trajectory_net import TrajectoryNet, TrajectoryNetSettings
from model_zoo.layers.velocity_net import VelocityNet, VelocityNetSettings
from model_zoo.picture_input import normalised_picture, shrunk_drawing
from model_zoo.point_choice import choose_points, nearby_points
from model_zoo.point_scale import bounded

COLUMNS = ("image", "points", "point_count", "velocity_history", "trajectory_image")


class SensorEncoderSettings(Settings):
    """The sizes of the four encoders.

    Attributes:
        picture_size: Height and width of the pictures in the dataset.
        shrink: Pixels a side that become one, in both pictures, before anything else.
        image_width: Channels of ResNet18's first stage.
        image_reduction: Of its attention's MLP.
        point_number: Points of a cloud that are looked at.
        point_reach: Metres around the robot, horizontally, within which points are looked at; None
            looks at all. Ours: a robot goes less than 2 m within the horizon.
        point_range: Metres at which the length of a point is taken in as 0.5; see ``bounded``.
        points: PointNet.
        velocity: VelNet.
        trajectory: TrajNet.
        normalise: Whether f_vec is batch-normalised before its sigmoid. Ours: without it features
            hardly leave 0.5 at first, all edges weigh the same, and training does not begin.
    """

    picture_size: tuple[Side, Side] = (240, 320)
    shrink: Shrink = 1
    image_width: Width = 64
    image_reduction: Units = 16
    point_number: Points = 10_000
    point_reach: Metres | None = None
    point_range: Metres = 3.0
    points: PointNetSettings = PointNetSettings()
    velocity: VelocityNetSettings = VelocityNetSettings()
    trajectory: TrajectoryNetSettings = TrajectoryNetSettings()
    normalise: bool = True


class SensorFeatures(NamedTuple):
    """f_vec, (B, 120) within 0 and 1, and PointNet's feature transform or None."""

    vector: Tensor
    transform: Tensor | None


class SceneEncoding(NamedTuple):
    """The scene's part of f_vec by sensor, not yet normalised, and PointNet's transform or None."""

    features: Features
    transform: Tensor | None


class SensorEncoders(nn.Module):
    """An observation to f_vec: features of picture, points, trajectory and velocities, in a row."""

    def __init__(self, settings: SensorEncoderSettings, counts: FeatureCounts) -> None:
        """Make the four encoders, with ``counts`` outputs."""
        super().__init__()
        self.settings = settings
        height, width = (side // settings.shrink for side in settings.picture_size)
        self.image = ResNet18(counts.image, settings.image_width, settings.image_reduction)
        self.points = PointNet(counts.point, settings.points)
        self.trajectory = TrajectoryNet(counts.trajectory, (height, width), settings.trajectory)
        self.velocity = VelocityNet(counts.velocity, settings.velocity)
        self.norm = nn.BatchNorm1d(counts.nodes) if settings.normalise else nn.Identity()

    def forward(self, observation: Observation) -> SensorFeatures:
        """The features, all past one sigmoid."""
        features, transform = self.scene(observation)
        return SensorFeatures(self.join(features, observation["trajectory_image"]), transform)

    def scene(self, observation: Observation) -> SceneEncoding:
        """What all trajectories in a scene share: features of picture, points and velocities."""
        points, count = observation["points"], observation["point_count"]
        if self.settings.point_reach is not None:
            points, count = nearby_points(points, count, self.settings.point_reach)
        chosen = choose_points(points, count, self.settings.point_number)
        cloud = self.points(bounded(chosen, self.settings.point_range))
        features = {
            "image_features": self.image(
                normalised_picture(observation["image"], self.settings.shrink)
            ),
            "point_features": cloud.vector,
            "velocity_features": self.velocity(observation["velocity_history"]),
        }
        return SceneEncoding(features, cloud.transform)

    def join(self, features: Features, trajectory_image: Tensor) -> Tensor:
        """f_vec (K, 120) of K trajectory images (K, H, W) in as many scenes, or in one."""
        rows = trajectory_image.shape[0]
        image, point, velocity = (
            features[name].expand(rows, -1)
            for name in ("image_features", "point_features", "velocity_features")
        )
        drawing = shrunk_drawing(trajectory_image, self.settings.shrink)
        trajectory = self.trajectory(drawing)
        joined = torch.cat((image, point, trajectory, velocity), dim=1)
        return torch.sigmoid(self.norm(joined.float()))
