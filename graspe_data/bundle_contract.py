"""``contract.json`` of a bundle: what its graphs take and give, and for which robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, StringConstraints, model_validator

from graspe_data.documents import Sha256
from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from graspe_data.manifest import Settings
from graspe_data.observation.catalogue import columns_of
from graspe_data.observation.settings import Count, ObservationSettings
from graspe_data.robot import Footprint, Intrinsics, Limits, Vector3
from graspe_data.sealed_folder import SealedFolder

BUNDLE_FORMAT = "graspe-bundle-1"
ENCODE_GRAPH, SCORE_GRAPH = "encode.onnx", "score.onnx"
CONTRACT_FILE, RECORDED_FILE, PARITY_FILE = "contract.json", "recorded.npz", "parity.json"
CARD_FILE = "card.md"
SEALED_FILES = frozenset(
    {ENCODE_GRAPH, SCORE_GRAPH, CONTRACT_FILE, RECORDED_FILE, PARITY_FILE, CARD_FILE}
)
"""All files of a bundle but its seal."""
BUNDLE = SealedFolder(
    name="bundle",
    format=BUNDLE_FORMAT,
    files=SEALED_FILES,
    refusal=PlannerError,
    remedy="Export the bundle again with `graspe export`, or copy it again.",
)

Seconds = Annotated[float, Field(gt=0)]
Probability = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,63}$")]
_TOLERANCE = 1e-6

Matrix3 = tuple[Vector3, Vector3, Vector3]


class GraphTensor(Settings):
    """One input or output of a graph.

    Attributes:
        name: As in the graph.
        dtype: NumPy's name.
        shape: ``K`` stands for the number of candidates; all other sizes are fixed.
        unit: SI; empty where it has none.
        frame: Frame of its coordinates; empty where it has none.
        meaning: What it is, for people.
    """

    name: Name
    dtype: Literal["bool", "uint8", "int32", "int64", "float32"]
    shape: tuple[Count | Literal["K"], ...]
    unit: str = ""
    frame: str = ""
    meaning: str = ""


class SensorPose(Settings):
    """A rigid transform that carries points of a sensor into base_link: p' = R p + t, metres."""

    rotation: Matrix3
    translation: Vector3

    @model_validator(mode="after")
    def _rigid(self) -> Self:
        matrix = np.array(self.rotation)
        is_rotation = np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6)
        if not is_rotation or np.linalg.det(matrix) < 0:
            raise ValueError("rotation is no rotation: its rows are not orthonormal")
        return self

    @classmethod
    def of(cls, transform: Transform) -> Self:
        """The pose of a transform."""
        first, second, third = (tuple(row) for row in transform.rotation.tolist())
        x, y, z = transform.translation.tolist()
        return cls(rotation=(first, second, third), translation=(x, y, z))

    def transform(self) -> Transform:
        """The same, to compute with."""
        return Transform(np.array(self.rotation), np.array(self.translation))


class RobotContract(Settings):
    """The robot of the training data: its planner's robot must match.

    Attributes:
        name: Of its manifest.
        camera: Calibration of the picture as the model sees it, without distortion, of
            ``picture_size``; None where the recordings differ or do not tell.
        base_from_camera: Carries points of the optical frame into base_link; None likewise.
        base_from_lidar: Carries points of the lidar into base_link; None likewise.
        camera_frame: That pictures name; None where the robot's manifest leaves it open.
        lidar_frame: That clouds name; None likewise.
        base_height: Height of base_link above the ground, metres.
        footprint: Its width is that of the drawn trajectory.
        limits: Velocities and accelerations.
        unknown: Why a field is None, by the field's name.
    """

    name: str
    camera: Intrinsics | None = None
    base_from_camera: SensorPose | None = None
    base_from_lidar: SensorPose | None = None
    camera_frame: str | None = None
    lidar_frame: str | None = None
    base_height: float
    footprint: Footprint
    limits: Limits
    unknown: Mapping[str, str] = {}


class Assumptions(Settings):
    """What a model's training data were made with."""

    observation: ObservationSettings
    robot: RobotContract


class Thresholds(Settings):
    """From which probabilities and reliabilities on GrASPE's planner believes.

    Attributes:
        acceptance: e_th of section IV-G: a candidate is taken when min(E) is this or more.
        reliability: r_th of equation (8): the first branch holds at this or less.
    """

    acceptance: Probability = 0.5
    reliability: Probability = 0.4


class Decision(Thresholds):
    """How GrASPE turns probabilities into a choice.

    Attributes:
        step_weights: Of a weighted score over the T steps; nearer ones count more, sum 1.
    """

    step_weights: tuple[Probability, ...]


class Tolerance(Settings):
    """How far onnxruntime may be from torch.

    Attributes:
        absolute: Of any probability.
    """

    absolute: Annotated[float, Field(gt=0, lt=1)] = 1e-4


class BundleContract(Settings):
    """The content of ``contract.json``.

    ``encode`` takes one observation and gives features; ``score`` takes these features, unchanged,
    and K candidates.

    Attributes:
        format: Version of the bundle's layout.
        model: Its name in the zoo.
        preset: The preset that it began from.
        horizon: Steps predicted, T.
        step_s: Time between them.
        encode_inputs: Columns of one observation, with a leading axis of 1.
        features: Outputs of ``encode``, the first inputs of ``score``.
        score_inputs: The others: ``trajectory_image`` (K, H, W), ``r_img`` and ``r_point`` (1,), as
            far as the model takes them.
        output: Calibrated probabilities of success, float32 (K, T), 1 = success.
        uses_candidates: Without it the output is (1, T), whatever the candidate.
        temperature: By which logits are divided within the graph.
        decision: Thresholds.
        observation: How inputs are derived.
        robot: Whom for.
        dataset_digest: Of the dataset it was trained on.
        checkpoint_digest: Of the checkpoint it was exported from.
        parity: Kept on the rows of ``parity.json``.
        opset: Of the graphs.
    """

    format: Literal["graspe-bundle-1"] = "graspe-bundle-1"
    model: str
    preset: str
    horizon: Count
    step_s: Seconds
    encode_inputs: tuple[GraphTensor, ...]
    features: tuple[GraphTensor, ...]
    score_inputs: tuple[GraphTensor, ...]
    output: GraphTensor
    uses_candidates: bool
    temperature: Annotated[float, Field(gt=0)] = 1.0
    decision: Decision
    observation: ObservationSettings
    robot: RobotContract
    dataset_digest: Sha256
    checkpoint_digest: Sha256
    parity: Tolerance = Tolerance()
    opset: Annotated[int, Field(ge=1, le=1000)]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        tensors = (*self.encode_inputs, *self.features, *self.score_inputs, self.output)
        names = [tensor.name for tensor in tensors]
        if len(set(names)) != len(names):
            raise ValueError("two tensors have the same name")
        if self.output.shape != ("K" if self.uses_candidates else 1, self.horizon):
            raise ValueError(f"output has shape {self.output.shape}, not (K, {self.horizon})")
        if len(self.decision.step_weights) != self.horizon:
            raise ValueError(f"step_weights are {len(self.decision.step_weights)}, not the horizon")
        if abs(sum(self.decision.step_weights) - 1) > _TOLERANCE:
            raise ValueError(f"step_weights sum to {sum(self.decision.step_weights):g}, not 1")
        self._said_twice()
        self._columns_fit()
        return self

    def _said_twice(self) -> None:
        """What stands in two places has to agree."""
        observed, robot = self.observation, self.robot
        height, width = observed.picture_size
        pairs = {
            "observation.horizon_steps and horizon": (observed.horizon_steps, self.horizon),
            "observation.horizon_step_s and step_s": (observed.horizon_step_s, self.step_s),
            "observation.points.base_height and robot.base_height": (
                observed.points.base_height,
                robot.base_height,
            ),
        }
        if robot.camera is not None:
            pairs |= {
                "picture_size and the camera's height": (height, robot.camera.height),
                "picture_size and the camera's width": (width, robot.camera.width),
            }
        for names, (one, other) in pairs.items():
            if abs(one - other) > _TOLERANCE:
                raise ValueError(f"{names} differ: {one:g} and {other:g}")

    def _columns_fit(self) -> None:
        """Columns that the observation makes have the shapes that it makes."""
        columns = {column.name: column for column in columns_of(self.observation.sizes, {})}
        for tensor in (*self.encode_inputs, *self.score_inputs):
            column = columns.get(tensor.name)
            leading = "K" if tensor.name == "trajectory_image" else 1
            expected = (leading, *column.shape) if column else tensor.shape
            if tensor.shape != expected:
                raise ValueError(
                    f"{tensor.name} has shape {tensor.shape}, the observation makes {expected}"
                )
