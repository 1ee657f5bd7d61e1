"""The planning map of every cloud of a recording."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

from pydantic import Field

from graspe_data.arrays import Map
from graspe_data.errors import GeometryError, ObservationError, RecordingError
from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.observation.intensity_map import (
    GlassMemory,
    IntensityScale,
    Moment,
    PlanningMap,
    PlanningMapSettings,
    intensity_layers,
    planning_map,
)
from graspe_data.observation.odometry_series import sample_odometry
from graspe_data.recordings.decoding.lidars.cloud_source import CloudMessage, CloudSource
from graspe_data.recordings.messages import RawMessage
from graspe_data.recordings.recording import Recording
from graspe_data.sensor_data import PointCloud
from graspe_data.synchronisation.synchronised import SynchronisedRecording
from pipelines.dataset_settings import DatasetRecipe


class MapRequest(Settings):
    """What is asked of a recording's maps."""

    planning: PlanningMapSettings = PlanningMapSettings()
    goal: tuple[float, float] = (10.0, 0.0)
    """x, y in base_link, metres: ahead of the robot wherever it is."""
    camera: bool = True
    """Draw what the camera saw, too."""
    every: Annotated[int, Field(ge=1)] = 1
    """Map one cloud of so many; glass is remembered from all that are mapped."""


@dataclass(frozen=True)
class MappedCloud:
    """One cloud and its maps. ``picture``: the latest message of the camera before the cloud."""

    stamp_ns: int
    cloud: PointCloud
    base_from_lidar: Transform
    layers: Map
    planned: PlanningMap
    picture: RawMessage | None
    wall_s: float
    """From the decoded cloud to the planning map."""


@dataclass(frozen=True)
class UnmappedCloud:
    """A cloud without a map, and why."""

    stamp_ns: int
    reason: str


class CloudMapper:
    """Maps the clouds of one recording in turn."""

    def __init__(
        self,
        recording: Recording,
        synchronised: SynchronisedRecording,
        recipe: DatasetRecipe,
        request: MapRequest,
    ) -> None:
        """Prepare the decoder, and the odometry at each cloud's stamp."""
        self._recording, self._synchronised = recording, synchronised
        self._recipe, self._request = recipe, request
        self._source = CloudSource(recording, recipe.robot.topics.points, recipe.robot.lidar)
        self._index = {n: k for k, n in enumerate(synchronised.points_ordinal.tolist())}
        gap_s = recipe.dataset.window.odometry_gap_s
        stamps = synchronised.points_ns
        self._odometry = sample_odometry(synchronised.odometry, stamps, gap_s)
        self._memory: GlassMemory | None = None
        self._scale = IntensityScale(recipe.intensity_returns.intensity_maximum)

    def __len__(self) -> int:
        """How many clouds are asked for."""
        return len(range(0, len(self._index), self._request.every))

    def __iter__(self) -> Iterator[MappedCloud | UnmappedCloud]:
        """Map one cloud after another."""
        topics = self._recipe.robot.topics
        ordinal, picture = -1, None
        messages = self._recording.messages([topics.image, topics.points])
        for message in self._source.gather(messages):
            if isinstance(message, RawMessage):
                picture = message
                continue
            ordinal += 1
            place = self._index.get(ordinal)
            if place is not None and place % self._request.every == 0:
                yield self._mapped(message, place, picture)

    def _mapped(
        self, message: CloudMessage, place: int, picture: RawMessage | None
    ) -> MappedCloud | UnmappedCloud:
        stamp_ns = int(self._synchronised.points_ns[place])
        if not self._odometry.known[place]:
            return UnmappedCloud(stamp_ns, "no odometry at the cloud's stamp")
        x, y, _, _, _, yaw = self._odometry.pose[place].tolist()
        try:
            cloud = message.decode()
            found = self._plan(cloud, Moment(stamp_ns, (x, y, yaw), self._request.goal))
        except (RecordingError, ObservationError, GeometryError) as error:
            return UnmappedCloud(stamp_ns, str(error))
        return replace(found, picture=picture)

    def _plan(self, cloud: PointCloud, moment: Moment) -> MappedCloud:
        recipe, settings = self._recipe, self._recipe.dataset.intensity_map
        placed = self._synchronised.placement.place_cloud(cloud, moment.stamp_ns)
        cloud, mounting = placed.cloud, placed.base_from_lidar
        begin = time.perf_counter()
        returns = recipe.intensity_returns
        layers = intensity_layers(cloud, mounting, returns, settings, self._scale)
        wanted, cell = self._request.planning, settings.grid.cell_m
        eye = mounting.translation
        moment = replace(moment, eye=(float(eye[0]), float(eye[1])))
        planned = planning_map(layers, moment, self._memory, cell, wanted)
        took = time.perf_counter() - begin
        self._memory = planned.memory
        return MappedCloud(moment.stamp_ns, cloud, mounting, layers, planned, None, took)
