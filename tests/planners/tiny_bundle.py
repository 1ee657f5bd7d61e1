"""A bundle of two small graphs: a model that fears the left and the dark."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from graspe_data.bundle_contract import (
    BUNDLE_FORMAT,
    CARD_FILE,
    CONTRACT_FILE,
    ENCODE_GRAPH,
    PARITY_FILE,
    RECORDED_FILE,
    SCORE_GRAPH,
    BundleContract,
    Decision,
    GraphTensor,
    RobotContract,
    SensorPose,
)
from graspe_data.calibration import Calibration
from graspe_data.observation.image_reliability import ImageReliabilitySettings
from graspe_data.observation.point_reliability import PointReliabilitySettings
from graspe_data.observation.point_sample import PointSampleSettings
from graspe_data.observation.settings import ObservationSettings, PointObservationSettings
from graspe_data.observation.undistortion import rectifier
from graspe_data.robot import Robot
from graspe_data.sealed_folder import SEAL_FILE, seal_text

HEIGHT, WIDTH, STEPS, HISTORY, POINTS = 24, 32, 10, 20, 400

_TYPES = {"uint8": TensorProto.UINT8, "int32": TensorProto.INT32, "float32": TensorProto.FLOAT}

ENCODE_INPUTS = (
    GraphTensor(name="image", dtype="uint8", shape=(1, HEIGHT, WIDTH, 3)),
    GraphTensor(name="points", dtype="float32", shape=(1, POINTS, 3)),
    GraphTensor(name="velocity_history", dtype="float32", shape=(1, HISTORY, 2)),
)
FEATURES = (GraphTensor(name="brightness", dtype="float32", shape=(1, 1)),)
SCORE_INPUTS = (
    GraphTensor(name="trajectory_image", dtype="uint8", shape=("K", HEIGHT, WIDTH)),
    GraphTensor(name="r_point", dtype="float32", shape=(1,)),
)


def tiny_contract(
    robot: Robot, calibration: Calibration, *, uses_candidates: bool = True
) -> BundleContract:
    """What a planner has to know of the model."""
    return BundleContract(
        model="tiny",
        preset="small",
        horizon=STEPS,
        step_s=0.3,
        encode_inputs=ENCODE_INPUTS,
        features=FEATURES,
        score_inputs=SCORE_INPUTS if uses_candidates else (),
        output=GraphTensor(
            name="success", dtype="float32", shape=("K" if uses_candidates else 1, STEPS)
        ),
        uses_candidates=uses_candidates,
        decision=Decision(step_weights=(0.1,) * STEPS),
        observation=_observation(robot),
        robot=_robot(robot, calibration),
        dataset_digest="0" * 64,
        checkpoint_digest="1" * 64,
        opset=18,
    )


def write_tiny_bundle(folder: Path, contract: BundleContract) -> Path:
    """Write and seal a bundle."""
    folder.mkdir(parents=True)
    contents = {
        ENCODE_GRAPH: encode_graph(),
        SCORE_GRAPH: score_graph() if contract.uses_candidates else scene_graph(),
        CONTRACT_FILE: contract.model_dump_json().encode(),
        RECORDED_FILE: recorded(),
        PARITY_FILE: b"{}",
        CARD_FILE: b"# tiny",
    }
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    seal(folder)
    return folder


def seal(folder: Path) -> None:
    """Write the seal over whatever the files now hold."""
    files = {path.name: path.read_bytes() for path in folder.iterdir() if path.name != SEAL_FILE}
    (folder / SEAL_FILE).write_bytes(seal_text(BUNDLE_FORMAT, files))


def recorded(offset: float = 0.0) -> bytes:
    """A white and a black scene with two candidates, the second of which goes left."""
    images = np.zeros((2, HEIGHT, WIDTH), np.uint8)
    images[1, 20, 3] = 1
    arrays: dict[str, Any] = {"trajectory_image": images}
    for name, grey, success in (("white", 255, (1.0, 0.1)), ("black", 0, (0.0, 0.0))):
        arrays[f"{name}/image"] = np.full((1, HEIGHT, WIDTH, 3), grey, np.uint8)
        arrays[f"{name}/points"] = np.zeros((1, POINTS, 3), np.float32)
        arrays[f"{name}/velocity_history"] = np.zeros((1, HISTORY, 2), np.float32)
        arrays[f"{name}/r_point"] = np.zeros(1, np.float32)
        column = np.array(success, np.float32)[:, None] + np.float32(offset)
        arrays[f"{name}/success_2"] = np.repeat(column, STEPS, axis=1)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def encode_graph(name: str = "brightness") -> bytes:
    """Twice the mean grey value, at most 1."""
    nodes = [
        helper.make_node("Cast", ["image"], ["grey"], to=TensorProto.FLOAT),
        helper.make_node("ReduceMean", ["grey", "axes"], ["mean"], keepdims=0),
        helper.make_node("Mul", ["mean", "scale"], ["scaled"]),
        helper.make_node("Min", ["scaled", "one"], ["least"]),
        helper.make_node("Reshape", ["least", "shape"], [name]),
    ]
    constants = {
        "axes": np.array([0, 1, 2, 3], np.int64),
        "scale": np.array(2 / 255, np.float32),
        "one": np.array(1, np.float32),
        "shape": np.array([1, 1], np.int64),
    }
    output = GraphTensor(name=name, dtype="float32", shape=(1, 1))
    return _model(nodes, constants, ENCODE_INPUTS, [output])


def score_graph() -> bytes:
    """Brightness, less 0.9 for trajectories that reach the left quarter of the picture."""
    nodes = [
        helper.make_node("Cast", ["trajectory_image"], ["drawn"], to=TensorProto.FLOAT),
        helper.make_node("Slice", ["drawn", "begin", "end", "across"], ["left"]),
        helper.make_node("ReduceMax", ["left", "axes"], ["fear"], keepdims=0),
        helper.make_node("Unsqueeze", ["fear", "last"], ["column"]),
        helper.make_node("Mul", ["column", "weight"], ["loss"]),
        helper.make_node("Sub", ["brightness", "loss"], ["difference"]),
        helper.make_node("Max", ["difference", "zero"], ["probability"]),
        helper.make_node("Mul", ["probability", "steps"], ["success"]),
    ]
    constants = {
        "begin": np.array([0], np.int64),
        "end": np.array([WIDTH // 4], np.int64),
        "across": np.array([2], np.int64),
        "axes": np.array([1, 2], np.int64),
        "last": np.array([1], np.int64),
        "weight": np.array(0.9, np.float32),
        "zero": np.array(0, np.float32),
        "steps": np.ones((1, STEPS), np.float32),
    }
    output = GraphTensor(name="success", dtype="float32", shape=("K", STEPS))
    return _model(nodes, constants, (*FEATURES, *SCORE_INPUTS), [output])


def scene_graph() -> bytes:
    """Brightness, whatever the candidate."""
    nodes = [helper.make_node("Mul", ["brightness", "steps"], ["success"])]
    constants = {"steps": np.ones((1, STEPS), np.float32)}
    output = GraphTensor(name="success", dtype="float32", shape=(1, STEPS))
    return _model(nodes, constants, FEATURES, [output])


def _observation(robot: Robot) -> ObservationSettings:
    return ObservationSettings(
        picture_size=(HEIGHT, WIDTH),
        points=PointObservationSettings(
            sample=PointSampleSettings(count=POINTS),
            rings=robot.lidar.rings,
            minimum_range=robot.lidar.minimum_range,
            base_height=robot.base_height,
        ),
        image_reliability=ImageReliabilitySettings(),
        point_reliability=PointReliabilitySettings(),
        history_steps=HISTORY,
        history_step_s=0.1,
        odometry_gap_s=0.25,
        points_tolerance_s=0.1,
        horizon_steps=STEPS,
        horizon_step_s=0.3,
    )


def _robot(robot: Robot, calibration: Calibration) -> RobotContract:
    poses = [
        SensorPose(
            rotation=tuple(map(tuple, mounting.rotation.tolist())),
            translation=tuple(mounting.translation.tolist()),
        )
        for mounting in (calibration.base_from_camera, calibration.base_from_lidar)
    ]
    return RobotContract(
        name=robot.name,
        camera=rectifier(calibration.intrinsics, (WIDTH, HEIGHT)).intrinsics,
        base_from_camera=poses[0],
        base_from_lidar=poses[1],
        base_height=robot.base_height,
        footprint=robot.footprint,
        limits=robot.limits,
    )


def _model(
    nodes: Sequence[Any],
    constants: dict[str, Any],
    inputs: Sequence[GraphTensor],
    outputs: Sequence[GraphTensor],
) -> bytes:
    graph = helper.make_graph(
        nodes,
        "tiny",
        [_value(tensor) for tensor in inputs],
        [_value(tensor) for tensor in outputs],
        [numpy_helper.from_array(value, name) for name, value in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    onnx.checker.check_model(model)
    return bytes(model.SerializeToString())


def _value(tensor: GraphTensor) -> Any:
    return helper.make_tensor_value_info(tensor.name, _TYPES[tensor.dtype], list(tensor.shape))
