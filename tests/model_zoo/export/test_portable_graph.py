from __future__ import annotations

import numpy as np
import onnxruntime
import pytest
from onnx import ModelProto, TensorProto, helper, numpy_helper

from model_zoo.export.portable_graph import portable_graph


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
