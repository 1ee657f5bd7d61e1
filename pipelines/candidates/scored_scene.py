"""Many velocities scored in one scene of a dataset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.errors import PlannerError
from graspe_data.observation.trajectory import PredictedTrajectory
from graspe_data.robot import Limits
from graspe_data.shards.dataset import Dataset
from pipelines.report.row_scene import SCENE_COLUMNS, RowScene, row_scene
from planners.bundle import Bundle

LINEAR, YAW_RATES = 3, 15
SCENES = 24


@dataclass(frozen=True)
class ScoredScene:
    """A row with what a model makes of its candidates.

    Attributes:
        scene: The row.
        name: What to call it.
        model: The bundle's.
        velocities: float64 (K, 2), m/s and rad/s.
        success: float32 (K, T), 1 = success.
        acceptance: e_th of the bundle.
    """

    scene: RowScene
    name: str
    model: str
    velocities: Floats
    success: NDArray[np.float32]
    acceptance: float

    @property
    def least(self) -> NDArray[np.float32]:
        """min(E) of each candidate, (K,)."""
        least: NDArray[np.float32] = self.success.min(axis=1)
        return least


def candidate_lattice(limits: Limits) -> Floats:
    """Velocities (K, 2) ahead: some speeds, each with yaw rates over all that the robot can."""
    fastest = limits.linear_velocity[1]
    linear = fastest * np.arange(1, LINEAR + 1) / LINEAR
    yaw_rate = np.linspace(*limits.yaw_rate, YAW_RATES)
    return np.stack(np.meshgrid(linear, yaw_rate, indexing="ij"), axis=-1).reshape(-1, 2)


def score_row(bundle: Bundle, dataset: Dataset, row: int) -> ScoredScene:
    """Score the lattice of velocities in the scene of a row.

    Args:
        bundle: The model.
        dataset: A split, opened with ``columns_of(bundle)``.
        row: Index of the row.

    Raises:
        PlannerError: The dataset does not keep the camera's calibration.
    """
    batch = dataset.batch([row])
    scene = row_scene(dataset.index, {name: batch[name][0] for name in SCENE_COLUMNS})
    velocities = candidate_lattice(scene.recipe.robot.limits)
    features = bundle.encode(
        {tensor.name: batch[tensor.name] for tensor in bundle.contract.encode_inputs}
    )
    inputs_of_score = {tensor.name: tensor for tensor in bundle.contract.score_inputs}
    candidates = {name: batch[name] for name in inputs_of_score if name in ("r_img", "r_point")}
    if "trajectory_image" in inputs_of_score:
        drawn = draw_candidates(scene, velocities)
        candidates["trajectory_image"] = drawn.astype(inputs_of_score["trajectory_image"].dtype)
    success = bundle.score(features, candidates)
    return ScoredScene(
        scene=scene,
        name=f"row {row}",
        model=bundle.contract.model,
        velocities=velocities,
        success=np.broadcast_to(success, (len(velocities), success.shape[1])),
        acceptance=bundle.contract.decision.acceptance,
    )


def columns_of(bundle: Bundle) -> tuple[str, ...]:
    """What a row has to hold to be scored and drawn."""
    contract = bundle.contract
    needed = {tensor.name for tensor in (*contract.encode_inputs, *contract.score_inputs)}
    features = {tensor.name for tensor in contract.features}
    return tuple(sorted({*SCENE_COLUMNS, *(needed - features)}))


def most_telling(bundle: Bundle, dataset: Dataset) -> ScoredScene:
    """Of some rows, evenly spaced over the split, that whose candidates differ most."""
    rows = np.unique(np.linspace(0, len(dataset) - 1, SCENES).astype(int)).tolist()
    scenes = (score_row(bundle, dataset, row) for row in rows)
    return max(scenes, key=lambda scored: float(scored.least.std()))


def draw_candidates(scene: RowScene, velocities: Floats) -> NDArray[np.bool_]:
    """Trajectory images, bool (K, H, W), of velocities (K, 2) in m/s and rad/s.

    Raises:
        PlannerError: The dataset does not keep the camera's calibration.
    """
    camera, robot = scene.camera, scene.recipe.robot
    if camera is None:
        raise PlannerError(
            f"{scene.recording}: dataset.json does not keep the camera's calibration, so no "
            "candidate can be drawn into its pictures. Build the dataset again."
        )
    horizon = scene.recipe.dataset.horizon
    drawing = PredictedTrajectory(
        *camera,
        base_height=robot.base_height,
        line_width=robot.footprint.width,
        steps=horizon.steps,
        step_s=horizon.step_s,
        behind=scene.recipe.dataset.trajectory_image.behind,
    )
    return np.stack([drawing.draw(v, omega) for v, omega in velocities.tolist()])
