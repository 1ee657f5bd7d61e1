"""Scores candidate velocities by what the sensors gave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.bundle_contract import BundleContract, GraphTensor
from graspe_data.calibration import Calibration
from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from graspe_data.robot import Intrinsics
from graspe_data.sensor_data import Picture, PointCloud
from planners.bundle import Bundle
from planners.graph import Arrays
from planners.observe import ObservedRow, RowObserver
from planners.robot_check import MatchSettings, check_sensors
from planners.situation import Situation


@dataclass(frozen=True)
class Scene:
    """An observation and what the model made of it: any number of candidates can be judged."""

    observation: ObservedRow
    features: Arrays


@dataclass(frozen=True)
class _SceneInputs:
    """Of what a scene was made."""

    picture: Picture | None
    cloud: PointCloud | None
    history: NDArray[np.float32]
    scene: Scene

    def is_of(self, situation: Situation, history: NDArray[np.float32]) -> bool:
        same = self.picture is situation.picture and self.cloud is situation.cloud
        return same and np.array_equal(self.history, history)


@dataclass(frozen=True)
class Scores:
    """``success``: float32 (K, T), 1 = success. ``r_img``, ``r_point``: reliabilities, 0..1."""

    success: NDArray[np.float32]
    r_img: float
    r_point: float


class Scorer:
    """Asks one bundle about one robot's candidates."""

    def __init__(
        self,
        bundle: Bundle,
        calibration: Calibration,
        source: str = "",
        match: MatchSettings | None = None,
    ) -> None:
        """Take a loaded bundle and the calibration of the robot whose sensors it knows.

        Args:
            bundle: The model.
            calibration: Of the robot.
            source: See ``RowObserver``.
            match: How far the robot may be from the bundle's.

        Raises:
            PlannerError: The sensors are not those of the bundle; see ``check_sensors``.
            ObservationError: The camera's distortion is not understood.
        """
        self.match = match or MatchSettings()
        check_sensors(bundle.contract, calibration, self.match)
        self._bundle, self._calibration = bundle, calibration
        self._observer = RowObserver(bundle.contract, calibration, source)
        self._last: _SceneInputs | None = None
        self._inputs = {tensor.name: tensor for tensor in bundle.contract.score_inputs}

    @property
    def contract(self) -> BundleContract:
        """The bundle's contract."""
        return self._bundle.contract

    @property
    def calibration(self) -> Calibration:
        """Of the robot."""
        return self._calibration

    @property
    def camera(self) -> Intrinsics:
        """Of the picture as the model sees it, without distortion."""
        return self._observer.camera

    @property
    def base_from_camera(self) -> Transform:
        """Carries points of the optical frame into base_link."""
        return self._calibration.base_from_camera

    def scene(self, situation: Situation) -> Scene:
        """Observe and encode the latest sensor data, once for all candidates.

        Asked again with the same picture and cloud, it gives the scene it made of them.

        Raises:
            PlannerError: Sensor data are missing, or do not cover the history.
            ObservationError: Sensor data are not what the calibration says.
        """
        # First of all: OpenCV's threads, too, are those of the process that loaded the bundle.
        self._bundle.check_process()
        history = self._observer.history(situation)
        if self._last is not None and self._last.is_of(situation, history):
            return self._last.scene
        observation = self._observer.observe(situation)
        scene = Scene(observation, self._bundle.encode(observation.columns))
        self._last = _SceneInputs(situation.picture, situation.cloud, history, scene)
        return scene

    def judge(self, scene: Scene, velocities: Floats) -> NDArray[np.float32]:
        """Probabilities of success, float32 (K, T), of velocities (K, 2) in m/s and rad/s.

        All in one call of the graph. A model that does not look at candidates gives all the same.

        Raises:
            PlannerError: A velocity is not finite, there is none, or they have another shape.
        """
        velocities = _pairs(velocities)
        success = self._bundle.score(scene.features, self._candidates(scene, velocities))
        return np.broadcast_to(success, (len(velocities), success.shape[1]))

    def score(self, situation: Situation, velocities: Floats) -> Scores:
        """Observe, encode and judge; as ``scene`` and ``judge``."""
        scene = self.scene(situation)
        success = self.judge(scene, velocities)
        return Scores(success, scene.observation.r_img, scene.observation.r_point)

    def _candidates(self, scene: Scene, velocities: Floats) -> Arrays:
        """What ``score`` takes of the candidates and the reliabilities."""
        arrays = {
            name: array for name, array in scene.observation.columns.items() if name in self._inputs
        }
        if "trajectory_image" in self._inputs:
            images = self._observer.trajectory_images(velocities)
            arrays["trajectory_image"] = _as_taken(images, self._inputs["trajectory_image"])
        return arrays


def _pairs(velocities: Floats) -> Floats:
    try:
        pairs = np.asarray(velocities, np.float64)
    except (TypeError, ValueError) as error:
        raise PlannerError(f"velocities to score are no numbers: {error}.") from error
    if pairs.ndim != 2 or pairs.shape[1] != 2 or len(pairs) == 0:  # noqa: PLR2004
        raise PlannerError(
            f"velocities to score: {pairs.shape}, expected (K, 2), m/s and rad/s, one at least."
        )
    if not np.isfinite(pairs).all():
        raise PlannerError(f"velocities to score: {len(pairs)}, all must be finite.")
    return pairs


def _as_taken(images: NDArray[np.bool_], tensor: GraphTensor) -> NDArray[np.generic]:
    return images.view(np.uint8) if tensor.dtype == "uint8" else images.astype(tensor.dtype)
