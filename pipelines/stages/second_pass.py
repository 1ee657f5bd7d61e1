"""The second pass over a recording: decode what the plan asks for, write it where it belongs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from copy import deepcopy

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Mask
from graspe_data.errors import GeometryError, ObservationError, RecordingError
from graspe_data.geometry import Transform
from graspe_data.observation.intensity_map import intensity_layers, store_layers
from graspe_data.observation.intensity_map.strength import IntensityScale
from graspe_data.observation.observe import observe_points
from graspe_data.observation.point_sample import row_seed
from graspe_data.observation.undistortion import Rectifier, rectifier
from graspe_data.recordings.decoding import PictureDecoder
from graspe_data.recordings.decoding.lidars.cloud_source import CloudMessage, CloudSource
from graspe_data.recordings.decoding.video import Outcome
from graspe_data.recordings.messages import Damage, RawMessage
from graspe_data.recordings.recording import Recording
from graspe_data.sensor_data import Picture, PointCloud
from graspe_data.synchronisation.camera_check import camera_intrinsics
from graspe_data.synchronisation.placement import PlacedCloud
from graspe_data.synchronisation.row_plan import RowPlan
from graspe_data.synchronisation.synchronised import SynchronisedRecording
from pipelines.dataset_settings import DatasetRecipe
from pipelines.episode import EpisodeWriter
from pipelines.stages.intensity_scale import recording_scale

Values = Mapping[str, NDArray[np.generic] | float]

NOT_READ_AGAIN = "not found again in the second pass"
_FAULTS = {
    RecordingError: "does not decode",
    ObservationError: "cannot be observed",
    GeometryError: "cannot be placed on the robot",
}


class SecondPass:
    """Fills the picture and cloud columns of the wanted rows of one recording."""

    def __init__(
        self,
        recording: Recording,
        synchronised: SynchronisedRecording,
        recipe: DatasetRecipe,
        recording_digest: str,
        wanted: Mask,
    ) -> None:
        """Prepare the calibration and the rows that wait for each message.

        Raises:
            RecordingError: Rows are wanted and there is no calibration, or none that can be undone.
        """
        self.recording, self.recipe, self.digest = recording, recipe, recording_digest
        self.synchronised, self.wanted = synchronised, wanted
        self.rectifier: Rectifier | None = self._rectifier() if wanted.any() else None
        self.camera_mountings: list[tuple[int, Transform]] = []
        plan, topics = synchronised.plan, recipe.robot.topics
        self._waiting = {
            topics.image: _rows_by_ordinal(plan.image, wanted),
            topics.points: _rows_by_ordinal(plan.points, wanted),
        }
        self._pictures = PictureDecoder(recording.topics[topics.image].message_type, topics.image)
        self._clouds = CloudSource(recording, topics.points, recipe.robot.lidar)
        self._settings = recipe.observation.points
        self._scale = self._intensity_scale() if wanted.any() else None
        self._mounts: list[Transform] = []
        self._cloud_ns, self._cloud_number = _cloud_times(plan), -1
        self.losses: list[Damage] = []

    @property
    def base_from_lidar(self) -> Transform | None:
        """The lidar's mounting, once clouds were read; None where it was not one throughout."""
        return self._mounts[0] if len(self._mounts) == 1 else None

    @property
    def base_from_camera(self) -> Transform | None:
        """The camera's mounting, once a picture was read; the last one where it changed."""
        return self.camera_mountings[-1][1] if self.camera_mountings else None

    def run(self, writer: EpisodeWriter) -> Counter[str]:
        """Write the rows, drop those that could not be made, and count these by reason."""
        plan, topics = self.synchronised.plan, self.recipe.robot.topics
        missing = {
            topics.image: self.wanted.copy(),
            topics.points: self.wanted & (plan.points >= 0),
        }
        for row in np.flatnonzero(self.wanted & (plan.points < 0)).tolist():
            writer.write(row, self._point_columns(_NO_CLOUD, _NOWHERE))
        reasons: dict[int, str] = {}
        for topic, rows, values in self._made() if self.wanted.any() else ():
            if isinstance(values, str):
                reasons |= dict.fromkeys(rows, values)
                continue
            for row in rows:
                writer.write(row, values)
            missing[topic][rows] = False
        unmade = missing[topics.image] | missing[topics.points]
        if not (self.wanted & ~unmade).all():
            writer.keep(np.flatnonzero(self.wanted & ~unmade))
        return Counter(reasons.get(row, NOT_READ_AGAIN) for row in np.flatnonzero(unmade).tolist())

    def _made(self) -> Iterator[tuple[str, list[int], Values | str]]:
        """Topic, rows and columns of each message that rows wait for, or why there are none."""
        image = self.recipe.robot.topics.image
        pictures = -1
        for raw in self.recording.messages(list(self._waiting)):
            if raw.topic == image:
                pictures += 1
                wanted = pictures in self._waiting[image]
                yield from self._made_pictures(self._take_picture(raw, wanted=wanted))
            else:
                yield from self._made_cloud(self._take_cloud(raw))
        yield from self._made_pictures(self._pictures.finish())
        yield from self._made_cloud(self._clouds.rest())

    def _take_cloud(self, raw: RawMessage) -> CloudMessage | None:
        try:
            return self._clouds.take(raw)
        except RecordingError as error:
            self._loss(raw.topic, "packet is damaged", str(error))
            return None

    def _made_cloud(
        self, cloud: CloudMessage | None
    ) -> Iterator[tuple[str, list[int], Values | str]]:
        if cloud is None:
            return
        self._cloud_number += 1
        rows = self._waiting[cloud.topic].get(self._cloud_number)
        if rows is not None:
            yield cloud.topic, rows, self._decode_cloud(cloud, self._cloud_ns[self._cloud_number])

    def _take_picture(self, raw: RawMessage, *, wanted: bool) -> list[Outcome]:
        if not wanted and not self._pictures.needs_all:
            self._pictures.skip()
            return []
        try:
            message = self.recording.decode(raw)
        except RecordingError as error:
            return self._pictures.lose(str(error))
        return self._pictures.take(message, wanted=wanted)

    def _made_pictures(
        self, outcomes: list[Outcome]
    ) -> Iterator[tuple[str, list[int], Values | str]]:
        topic = self.recipe.robot.topics.image
        for outcome in outcomes:
            rows = self._waiting[topic].get(outcome.ordinal)
            if rows is None:
                continue
            if outcome.picture is None:
                yield topic, rows, self._loss(topic, outcome.reason, outcome.detail)
                continue
            try:
                values = self._picture_columns(outcome.picture)
            except tuple(_FAULTS) as error:
                values = self._loss(topic, f"picture {_FAULTS[type(error)]}", str(error))
            yield topic, rows, values

    def _decode_cloud(self, message: CloudMessage, time_ns: int) -> Values | str:
        """The columns that a cloud gives, or the reason why it gives none."""
        try:
            placed = self._place(message.decode(), time_ns)
            return self._point_columns(placed.cloud, placed.base_from_lidar)
        except tuple(_FAULTS) as error:
            return self._loss(message.topic, f"cloud {_FAULTS[type(error)]}", str(error))

    def _loss(self, topic: str, reason: str, detail: str) -> str:
        """Keep the first fault of a topic, and give the reason."""
        if all(loss.topic != topic for loss in self.losses):
            self.losses.append(Damage(f"{reason}; the first: {detail}", topic))
        return reason

    def _picture_columns(self, picture: Picture) -> Values | str:
        if self.rectifier is None:
            return NOT_READ_AGAIN
        source, (height, width, _) = self.rectifier.source, picture.rgb.shape
        if (source.width, source.height) != (width, height):
            expected = f"{source.width}x{source.height}"
            return f"picture is {width}x{height}, the calibration is for {expected}"
        if not self.camera_mountings:
            placement = self.synchronised.placement
            self.camera_mountings = placement.camera_mountings(picture.frame)
        return {"image": self.rectifier.apply(picture.rgb), "image_valid": True}

    def _point_columns(self, cloud: PointCloud, base_from_lidar: Transform) -> Values:
        seed = row_seed(self.recipe.dataset.seed, self.digest, cloud.stamp_ns)
        observation = observe_points(cloud, base_from_lidar, self._settings, seed)
        return self._intensity_columns(cloud, base_from_lidar) | observation.columns()

    def _intensity_columns(
        self, cloud: PointCloud, base_from_lidar: Transform
    ) -> dict[str, NDArray[np.generic] | float]:
        settings = self.recipe.dataset.intensity_layers
        if settings is None:
            return {}
        if cloud is _NO_CLOUD:
            return {"intensity_map": np.zeros(settings.shape, np.uint8)}
        returns = self.recipe.intensity_returns
        # A copy holds each cloud against the first ones alone, whichever rows are asked for.
        scale = deepcopy(self._scale)
        layers = intensity_layers(cloud, base_from_lidar, returns, settings, scale)
        return {"intensity_map": store_layers(layers)}

    def _place(self, cloud: PointCloud, stamp_ns: int) -> PlacedCloud:
        placed = self.synchronised.placement.place_cloud(cloud, stamp_ns)
        if not any(_same(placed.base_from_lidar, mount) for mount in self._mounts):
            self._mounts.append(placed.base_from_lidar)
        return placed

    def _intensity_scale(self) -> IntensityScale | None:
        if self.recipe.dataset.intensity_layers is None:
            return None
        maximum = self.recipe.intensity_returns.intensity_maximum
        return recording_scale(self.recording, self.recipe.robot, maximum)

    def _rectifier(self) -> Rectifier:
        image, tracks = self.recipe.dataset.image, self.synchronised.tracks
        intrinsics = camera_intrinsics(tracks, self.recipe.robot, self.recording.path)
        try:
            return rectifier(intrinsics, (image.width, image.height))
        except ObservationError as error:
            raise RecordingError(f"{self.recording.path}: {error}") from error


_NOWHERE = Transform.identity()
_NO_CLOUD = PointCloud(
    stamp_ns=0,
    frame="",
    xyz=np.empty((0, 3), np.float32),
    intensity=None,
    ring=np.empty(0, np.int32),
)


def _same(one: Transform, other: Transform) -> bool:
    turned, moved = one.rotation - other.rotation, one.translation - other.translation
    return not (turned.any() or moved.any())


def _cloud_times(plan: RowPlan) -> dict[int, int]:
    """The time of each cloud that makes a row, by its ordinal."""
    times = plan.anchor_ns - plan.points_age_ns
    return dict(zip(plan.points.tolist(), times.tolist(), strict=True))


def _rows_by_ordinal(ordinals: NDArray[np.int64], wanted: Mask) -> dict[int, list[int]]:
    rows: dict[int, list[int]] = {}
    for row in np.flatnonzero((ordinals >= 0) & wanted).tolist():
        rows.setdefault(int(ordinals[row]), []).append(row)
    return rows
