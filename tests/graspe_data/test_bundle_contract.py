from __future__ import annotations

from typing import Any

import pytest

from graspe_data.bundle_contract import BundleContract
from graspe_data.errors import ManifestError
from graspe_data.manifest import validate

OBSERVATION = {
    "picture_size": (240, 320),
    "points": {"base_height": 0.2},
    "image_reliability": {},
    "point_reliability": {},
    "history_steps": 50,
    "history_step_s": 0.1,
    "odometry_gap_s": 0.25,
    "points_tolerance_s": 0.1,
    "horizon_steps": 2,
    "horizon_step_s": 0.3,
}
ROBOT = {
    "name": "tortoise",
    "base_height": 0.2,
    "footprint": {"length": 0.6, "width": 0.4},
    "limits": {"linear_velocity": (0.0, 0.5), "yaw_rate": (-1.0, 1.0)},
}


def content(**changes: Any) -> dict[str, Any]:
    return {
        "model": "graspe",
        "preset": "small",
        "horizon": 2,
        "step_s": 0.3,
        "encode_inputs": ({"name": "image", "dtype": "uint8", "shape": (1, 240, 320, 3)},),
        "features": ({"name": "image_features", "dtype": "float32", "shape": (1, 40)},),
        "score_inputs": ({"name": "trajectory_image", "dtype": "uint8", "shape": ("K", 240, 320)},),
        "output": {"name": "success", "dtype": "float32", "shape": ("K", 2)},
        "uses_candidates": True,
        "decision": {"step_weights": (0.6, 0.4)},
        "observation": OBSERVATION,
        "robot": ROBOT,
        "dataset_digest": "a" * 64,
        "checkpoint_digest": "b" * 64,
        "opset": 20,
    } | changes


def test_a_contract_survives_json() -> None:
    contract = validate(content(), BundleContract, "here")
    assert BundleContract.model_validate_json(contract.model_dump_json()) == contract
    assert contract.decision.acceptance == 0.5
    assert contract.decision.reliability == 0.4


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"horizon": 3}, r"output has shape \('K', 2\), not \(K, 3\)"),
        ({"uses_candidates": False}, "output has shape"),
        ({"decision": {"step_weights": (1.0,)}}, "step_weights are 1"),
        (
            {"features": ({"name": "image", "dtype": "float32", "shape": (1, 4)},)},
            "two tensors have the same name",
        ),
        ({"dataset_digest": "short"}, "dataset_digest"),
        ({"format": "graspe-bundle-0"}, "format"),
        ({"output": {"name": "success", "dtype": "object", "shape": ("K", 2)}}, "output.dtype"),
        ({"output": {"name": "success", "dtype": "float32", "shape": ("N", 2)}}, "output.shape"),
    ],
)
def test_a_contract_that_contradicts_itself_is_refused(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ManifestError, match=told):
        validate(content(**changes), BundleContract, "here")
