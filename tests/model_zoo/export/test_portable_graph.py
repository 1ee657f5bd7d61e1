"""Graphs give the same numbers after they were rewritten."""

from __future__ import annotations

import numpy as np
import onnxruntime
import pytest
from onnx import ModelProto, TensorProto, helper, numpy_helper

from model_zoo.export.portable_graph import loop_over_candidates, portable_graph


def graph_of_a_maximum(shape: tuple[int, ...], axis: int, keepdims: int) -> ModelProto:
    """The maximum of the double of an input, as torch exports it: with traces of its source."""
    double = helper.make_node("Add", ["x", "x"], ["doubled"])
    double.doc_string = "File /home/me/model.py"
    double.metadata_props.add(key="stack", value="File /home/me/model.py")
    nodes = [double, helper.make_node("ReduceMax", ["doubled", "axes"], ["y"], keepdims=keepdims)]
    reduced = list(shape)
    reduced[axis : axis + 1] = [1] if keepdims else []
    graph = helper.make_graph(
        nodes,
        "main_graph",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, shape)],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, reduced)],
        [numpy_helper.from_array(np.array([axis], np.int64), "axes")],
        value_info=[helper.make_tensor_value_info("doubled", TensorProto.FLOAT, shape)],
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 20)], ir_version=10)


@pytest.mark.parametrize(
    ("shape", "axis", "keepdims", "changed"),
    [
        ((1, 5, 3), 1, 0, True),
        ((2, 5, 3), 1, 0, False),
        ((1, 5, 3), 2, 0, False),
        ((1, 5, 3), 1, 1, False),
        ((1, 5, 3, 2), 1, 0, False),
    ],
)
def test_a_maximum_over_the_points_of_one_cloud_becomes_that_of_a_matrix(
    shape: tuple[int, ...], axis: int, keepdims: int, changed: bool
) -> None:
    made = portable_graph(graph_of_a_maximum(shape, axis, keepdims), ())
    assert ("Squeeze" in {node.op_type for node in made.graph.node}) == changed
    x = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    (found,) = onnxruntime.InferenceSession(made.SerializeToString()).run(None, {"x": x})
    np.testing.assert_array_equal(found, 2 * x.max(axis, keepdims=bool(keepdims)))


def test_no_trace_of_the_source_is_left() -> None:
    made = portable_graph(graph_of_a_maximum((1, 5, 3), 1, 0), ())
    assert b"/home/me" not in made.SerializeToString()


def test_vanishing_weights_are_none() -> None:
    model = graph_of_a_maximum((1, 5, 3), 2, 0)
    weights = np.array([1e-45, -1e-39, 1e-21, 0.0, 1e-19, -2.0], np.float32)
    model.graph.initializer.append(numpy_helper.from_array(weights, "weights"))
    stored = {c.name: numpy_helper.to_array(c) for c in portable_graph(model, ()).graph.initializer}
    np.testing.assert_array_equal(stored["weights"], np.array([0, 0, 0, 0, 1e-19, -2], np.float32))


def test_the_open_axis_is_called_k() -> None:
    model = graph_of_a_maximum((1, 5, 3), 2, 0)
    model.graph.input[0].type.tensor_type.shape.dim[0].dim_param = "s17"
    made = portable_graph(model, {"x"})
    assert made.graph.input[0].type.tensor_type.shape.dim[0].dim_param == "K"


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
