"""NMFNet's three branches and their fusion: picture, points and distance map to one vector."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import torch
from pydantic import Field
from torch import Tensor, nn
from torch.nn.functional import conv2d, linear, relu

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.bounds import Beams, Metres, Points, Shrink, Side, Units, Width
from model_zoo.contract import Observation
from model_zoo.distance_map import DistanceMap
from model_zoo.layers.pointnet import PointNetSettings, PointNetTrunk
from model_zoo.layers.resnet8 import ResNet8
from model_zoo.picture_input import normalised_picture
from model_zoo.point_choice import choose_points, nearby_points
from model_zoo.point_scale import bounded

COLUMNS = ("image", "points", "point_count", "laser_scan")


class SceneSettings(Settings):
    """The sizes of NMFNet's branches.

    Attributes:
        picture_size: Rows and columns of the picture.
        shrink: Pixels of each side of the squares over which it is averaged first.
        width: Channels of the first block of either ResNet8.
        point_number: Points chosen of each cloud.
        point_reach: Metres around the robot within which they are chosen, as GrASPE's; None takes
            all.
        point_range: Metres at which the length of a point is taken in as 0.5; see ``bounded``.
        point_net: Sizes of the points' network, of which the trunk is used.
        fusion: Channels of the two 1x1 convolutions that join points and picture.
        beams: Rays of a scan over half a circle.
        map_pixels: Pixels of each side of the distance map.
        map_depth: Metres that it reaches ahead.
    """

    picture_size: tuple[Side, Side] = (240, 320)
    shrink: Shrink = 1
    width: Width = 32
    point_number: Points = 10_000
    point_reach: Metres | None = None
    point_range: Metres = 3.0
    point_net: PointNetSettings = PointNetSettings()
    fusion: tuple[Units, Units] = (256, 128)
    beams: Beams = 720
    map_pixels: Annotated[int, Field(strict=True, ge=8, le=2048)] = 200
    map_depth: Metres = 10.0


class SceneFeatures(NamedTuple):
    """The vector (B, F), and PointNet's feature transform (B, K, K) or None."""

    vector: Tensor
    transform: Tensor | None


class SceneBranches(nn.Module):
    """Picture and points are joined early, place by place; the map comes in at the end.

    After the authors' article on NMFNet: ResNet8 for the picture and for the map, PointNet for the
    points, two 1x1 convolutions. The network's code was never published, and the article states
    no sizes of the fusion; those here are ours.

    Attributes:
        length: Of the vector, F.
    """

    def __init__(self, settings: SceneSettings) -> None:
        """Make the branches with random weights.

        Raises:
            ZooError: The picture is too small.
        """
        super().__init__()
        self.settings = settings
        self.image = ResNet8(3, settings.width)
        self.point_net = PointNetTrunk(settings.point_net)
        last = settings.point_net.channels[-1]
        self.fusion = _PlacewiseFusion(4 * settings.width, last, settings.fusion)
        self.draw = DistanceMap(settings.map_pixels, settings.map_depth, settings.beams)
        self.map = ResNet8(1, settings.width)
        rows, columns = ResNet8.feature_size(
            *(side // settings.shrink for side in settings.picture_size)
        )
        if rows < 1 or columns < 1:
            raise ZooError(
                f"a picture of {settings.picture_size} shrunk by {settings.shrink} is too small: "
                "ResNet8 makes nothing of it. Take a larger one, or shrink it less."
            )
        map_side, _ = ResNet8.feature_size(settings.map_pixels, settings.map_pixels)
        self.length = settings.fusion[1] * rows * columns + 4 * settings.width * map_side**2

    def forward(self, observation: Observation) -> SceneFeatures:
        """The features of :data:`COLUMNS`."""
        settings = self.settings
        picture = relu(self.image(normalised_picture(observation["image"], settings.shrink)))
        points, count = observation["points"], observation["point_count"]
        if settings.point_reach is not None:
            points, count = nearby_points(points, count, settings.point_reach)
        chosen = choose_points(points, count, settings.point_number)
        cloud = self.point_net(bounded(chosen, settings.point_range))
        near = relu(self.map(self.draw(observation["laser_scan"])))
        fused = self.fusion(picture, cloud.vector)
        vector = torch.cat((fused.flatten(1), near.flatten(1)), dim=1)
        return SceneFeatures(vector, cloud.transform)


class _PlacewiseFusion(nn.Module):
    """A vector joined to each place of a feature map, then two 1x1 convolutions.

    Only the convolutions learn: with the default sizes, 328,064 parameters.
    """

    def __init__(self, maps: int, vector: int, channels: tuple[int, int]) -> None:
        super().__init__()
        first, second = channels
        self.maps = maps
        self.join = nn.Conv2d(maps + vector, first, 1)
        self.rest = nn.Sequential(
            nn.BatchNorm2d(first, affine=False),
            nn.ReLU(),
            nn.Conv2d(first, second, 1),
            nn.BatchNorm2d(second, affine=False),
            nn.ReLU(),
        )

    def forward(self, maps: Tensor, vector: Tensor) -> Tensor:
        """Join maps (B, M, h, w) and vectors (B, V).

        The vector is the same at every place, so that its part of the first convolution is
        computed once a row instead of once a place.
        """
        weight, bias = self.join.weight, self.join.bias
        everywhere = linear(vector, weight[:, self.maps :, 0, 0], bias)
        joined = conv2d(maps, weight[:, : self.maps]) + everywhere[:, :, None, None]
        fused: Tensor = self.rest(joined)
        return fused
