"""What a planner observes is what the pipeline stores of the same moment, to the byte."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from graspe_data.bundle_contract import BundleContract
from graspe_data.calibration import Calibration
from graspe_data.geometry import Transform
from graspe_data.observation.point_sample import PointSampleSettings
from graspe_data.observation.settings import ImageSettings, PointSettings, TrajectoryImageSettings
from graspe_data.recordings.decoding import cloud_decoder, decode_image, decode_motion
from graspe_data.recordings.recording import open_recording
from graspe_data.robot import Robot
from graspe_data.sensor_data import Motion, Picture, PointCloud
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.recording import record_drive
from graspe_data.synchronisation.row_plan import WindowSettings
from graspe_data.synchronisation.synchronised import synchronise
from pipelines.dataset_settings import DatasetManifest, DatasetRecipe
from pipelines.episode import whole_column
from pipelines.process_recording import Episode, RecordingTask, process_recording
from planners.observe import RowObserver
from planners.situation import Situation
from tests.conftest import GardenDrive
from tests.planners.tiny_bundle import tiny_contract

LEGS = (Leg(2.5, 0.6, 0.0), Leg(1.5, 0.5, 0.3), Leg(2.0, -0.4, 0.1))
COLUMNS = ("image", "points", "point_count", "laser_scan", "velocity_history", "r_img", "r_point")


@dataclass(frozen=True)
class Recorded:
    """A recording as a robot would have met it, and as the pipeline stored it."""

    recipe: DatasetRecipe
    episode: Episode
    calibration: Calibration
    pictures: dict[int, Picture]
    clouds: dict[int, PointCloud]
    motions: tuple[Motion, ...]


@pytest.fixture(scope="module")
def recorded(
    tmp_path_factory: pytest.TempPathFactory, garden_drive: GardenDrive, robot: Robot
) -> Recorded:
    folder = tmp_path_factory.mktemp("row")
    record_drive(garden_drive(LEGS), folder / "drive.mcap", "mcap")
    manifest = DatasetManifest(
        name="row",
        robot=robot.name,
        window=WindowSettings(anchor_rate=5.0, history_steps=10),
        trajectory_image=TrajectoryImageSettings(behind=0.5),
        image=ImageSettings(width=80, height=64),
        points=PointSettings(sample=PointSampleSettings(count=500)),
    )
    recipe = DatasetRecipe(dataset=manifest, robot=robot)
    task = RecordingTask(folder / "drive.mcap", recipe, folder / "episodes")
    episode = process_recording(task)
    assert isinstance(episode, Episode)
    return _met(folder / "drive.mcap", recipe, episode)


def test_rows_are_equal_to_the_byte(recorded: Recorded) -> None:
    observer = RowObserver(_contract(recorded), recorded.calibration, recorded.episode.digest)
    stored = {name: _stored(recorded.episode, name) for name in COLUMNS}
    packed = np.asarray(_stored(recorded.episode, "trajectory_image"), np.uint8)
    drawn = np.unpackbits(packed, axis=-1).astype(np.bool_)
    situations = list(_situations(recorded))
    assert len(situations) > 4
    sampled = 0
    for row, situation in enumerate(situations):
        columns = observer.observe(situation).columns
        for name in COLUMNS:
            expected = stored[name][row]
            assert columns[name].dtype == expected.dtype, name
            assert columns[name][0].tobytes() == expected.tobytes(), (name, row)
        sampled += int(columns["point_count"][0]) == 500
        last = np.asarray(columns["velocity_history"][0, -1:], np.float64)
        assert np.array_equal(observer.trajectory_images(last)[0], drawn[row])
    assert sampled


def _met(path: Path, recipe: DatasetRecipe, episode: Episode) -> Recorded:
    robot = recipe.robot
    topics = robot.topics
    pictures, clouds, motions = {}, {}, []
    with open_recording(path) as recording:
        synchronised = synchronise(
            recording, robot, recipe.dataset.clocks, recipe.dataset.synchronisation
        )
        kinds = {name: info.message_type for name, info in recording.topics.items()}
        points = cloud_decoder(kinds[topics.points], topics.points, robot.lidar.model)
        for raw in recording.messages({topics.image, topics.points, topics.odometry}):
            message = recording.decode(raw)
            if raw.topic == topics.image:
                picture = decode_image(message, kinds[raw.topic], raw.topic)
                pictures[picture.stamp_ns] = picture
            elif raw.topic == topics.points:
                cloud = points(message)
                clouds[cloud.stamp_ns] = cloud
            else:
                motions.append(decode_motion(message, kinds[raw.topic], raw.topic))
    recorded_calibration, transforms = (
        synchronised.tracks.calibration,
        synchronised.placement.transforms,
    )
    assert recorded_calibration is not None
    cameras = next(iter(pictures.values())).frame
    lidars = next(iter(clouds.values())).frame
    calibration = Calibration(
        recorded_calibration.intrinsics,
        transforms.lookup(robot.base_frame, cameras, 0),
        transforms.lookup(robot.base_frame, lidars, 0),
    )
    return Recorded(recipe, episode, calibration, pictures, clouds, tuple(motions))


def _situations(recorded: Recorded) -> Iterator[Situation]:
    """The robot at the moment of each row, and some time after it."""
    stamps = _stored(recorded.episode, "stamp_ns").tolist()
    ages = _stored(recorded.episode, "points_age_ns").tolist()
    for stamp, age in zip(stamps, ages, strict=True):
        now = stamp + 60_000_000
        yield Situation(
            now_ns=now,
            pose=(0.0, 0.0, 0.0),
            velocity=(0.0, 0.0),
            goal=(1.0, 0.0),
            picture=recorded.pictures[stamp],
            cloud=recorded.clouds[stamp - age],
            motions=[m for m in recorded.motions if m.stamp_ns is not None and m.stamp_ns <= now],
        )


def _contract(recorded: Recorded) -> BundleContract:
    whole = tiny_contract(recorded.recipe.robot, recorded.calibration)
    return whole.model_copy(update={"observation": recorded.recipe.observation})


def _stored(episode: Episode, name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.generic]]:
    stage = {"trajectory_image": "trajectory", "r_img": "reliability", "r_point": "reliability"}
    return np.asarray(whole_column(episode.folders[stage.get(name, "extract")], name))


def test_the_mounting_is_that_of_the_recording(recorded: Recorded) -> None:
    rotation, translation = recorded.episode.extracted.base_from_camera or ((), ())
    found = recorded.calibration.base_from_camera
    expected = Transform(np.reshape(rotation, (3, 3)), np.array(translation))
    assert np.array_equal(found.rotation, expected.rotation)
    assert np.array_equal(found.translation, expected.translation)
