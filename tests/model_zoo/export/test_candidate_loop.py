from __future__ import annotations

import numpy as np
import onnxruntime
import pytest
from onnx import ModelProto, TensorProto, helper, numpy_helper

from model_zoo.export.candidate_loop import loop_over_candidates

WEIGHTS = np.arange(12, dtype=np.float32).reshape(4, 3)


def graph_of_sums() -> ModelProto:
    """(K, 4) @ WEIGHTS + shift (1, 3)."""
    nodes = [
        helper.make_node("Cast", ["candidates"], ["numbers"], to=TensorProto.FLOAT),
        helper.make_node("MatMul", ["numbers", "weights"], ["mixed"]),
        helper.make_node("Add", ["mixed", "shift"], ["sums"]),
    ]
    inputs = [
        helper.make_tensor_value_info("shift", TensorProto.FLOAT, [1, 3]),
        helper.make_tensor_value_info("candidates", TensorProto.UINT8, ["K", 4]),
    ]
    output = helper.make_tensor_value_info("sums", TensorProto.FLOAT, ["K", 3])
    weights = [numpy_helper.from_array(WEIGHTS, "weights")]
    graph = helper.make_graph(nodes, "sums", inputs, [output], weights)
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 20)], ir_version=10)


@pytest.mark.parametrize("chunk", [1, 3, 8])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 7, 8, 9, 100])
def test_any_number_in_turns_gives_what_all_at_once_gives(chunk: int, count: int) -> None:
    looped = loop_over_candidates(graph_of_sums(), "candidates", chunk)
    session = onnxruntime.InferenceSession(looped.SerializeToString())
    candidates = np.random.default_rng(0).integers(0, 9, (count, 4)).astype(np.uint8)
    shift = np.array([[1.0, -2.0, 0.5]], np.float32)
    (found,) = session.run(None, {"shift": shift, "candidates": candidates})
    assert found.shape == (count, 3)
    np.testing.assert_array_equal(found, candidates.astype(np.float32) @ WEIGHTS + shift)


def test_inputs_and_output_keep_their_names_and_shapes() -> None:
    plain = graph_of_sums()
    looped = loop_over_candidates(plain, "candidates")
    assert list(looped.graph.input) == list(plain.graph.input)
    assert list(looped.graph.output) == list(plain.graph.output)
