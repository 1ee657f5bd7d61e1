"""An exported graph without what its exporter alone needs, in forms that onnxruntime runs fast."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import onnx
from onnx import GraphProto, ModelProto, NodeProto, TensorProto, checker, helper, numpy_helper

_POINT_AXIS = 1
_RANK = 3
_FIRST = "first_axis"
VANISHING = 1e-20
"""Weights nearer to 0 are 0 in a graph."""


def portable_graph(model: ModelProto, open_names: Collection[str]) -> ModelProto:
    """Tidy a graph in place: the same numbers, the same bytes wherever it is exported.

    Args:
        model: As torch exported it, with the shapes of its values.
        open_names: Inputs and outputs whose first axis, where it has no fixed size, is called K.

    Returns:
        The model: checked, its maxima over points in a form that onnxruntime is quick at, without
        vanishing weights, traces of source files and shapes of inner values.
    """
    graph = model.graph
    _quick_maxima(graph)
    for constant in graph.initializer:
        _drop_vanishing(constant)
    for value in (*graph.input, *graph.output):
        first = value.type.tensor_type.shape.dim[0] if value.name in open_names else None
        if first is not None and first.HasField("dim_param"):
            first.dim_param = "K"
    graph.ClearField("value_info")
    graph.ClearField("metadata_props")
    model.ClearField("metadata_props")
    graph.name = "graph"
    for node in graph.node:
        node.ClearField("metadata_props")
        node.ClearField("doc_string")
    onnx.checker.check_model(model)
    return model


def _quick_maxima(graph: GraphProto) -> None:
    """Take maxima over the points of one cloud, (1, N, C) to (1, C), as those of a matrix.

    onnxruntime reduces the middle axis of three by a loop over single numbers, and the first of
    two by rows: twelve times faster.
    """
    shapes = {value.name: _shape(value) for value in graph.value_info}
    constants = {constant.name: constant for constant in graph.initializer}
    nodes: list[NodeProto] = []
    for node in graph.node:
        if node.op_type == "ReduceMax" and _is_over_points(node, shapes, constants):
            nodes += _as_matrix(node)
        else:
            nodes.append(node)
    if len(nodes) == len(graph.node):
        return
    graph.ClearField("node")
    graph.node.extend(nodes)
    graph.initializer.append(numpy_helper.from_array(np.array([0], np.int64), _FIRST))


def _as_matrix(node: NodeProto) -> list[NodeProto]:
    (output,) = node.output
    matrix = f"{output}_matrix"
    return [
        helper.make_node("Squeeze", [node.input[0], _FIRST], [matrix]),
        helper.make_node("ReduceMax", [matrix, _FIRST], [output], keepdims=1),
    ]


def _drop_vanishing(constant: TensorProto) -> None:
    """Set weights to 0 that weight decay left near it: no float32 sum shows the difference.

    Where they or their products are subnormal, a processor takes forty times as long.
    """
    if constant.data_type != TensorProto.FLOAT:
        return
    values = numpy_helper.to_array(constant)
    vanishing = (np.abs(values) < VANISHING) & (values != 0)
    if vanishing.any():
        kept = np.where(vanishing, np.float32(0), values)
        constant.CopyFrom(numpy_helper.from_array(kept, constant.name))


def _is_over_points(
    node: NodeProto,
    shapes: dict[str, tuple[int, ...]],
    constants: dict[str, TensorProto],
) -> bool:
    shape = shapes.get(node.input[0], ())
    axes = constants.get(node.input[1]) if len(node.input) > 1 else None
    kept = next((a.i for a in node.attribute if a.name == "keepdims"), 1)
    if len(shape) != _RANK or shape[0] != 1 or kept or axes is None:
        return False
    return numpy_helper.to_array(axes).ravel().tolist() == [_POINT_AXIS]


def _shape(value: onnx.ValueInfoProto) -> tuple[int, ...]:
    """The sizes of a value, 0 where they are open."""
    return tuple(axis.dim_value for axis in value.type.tensor_type.shape.dim)


CHUNK = 8
"""Candidates whose activations are held at once: they stay in the cache."""

_PART, _PART_OUTPUT = "candidate_part", "candidate_part_output"


def loop_over_candidates(model: ModelProto, candidates: str, chunk: int = CHUNK) -> ModelProto:
    """Make a graph that runs the given one on some candidates after the other, in one call.

    All at once they are as slow as the memory, since a layer's output for a hundred of them is
    far larger than any cache; in a loop they take half the time, and any number fits.

    Args:
        model: Takes ``candidates`` (K, ...) and other inputs, gives one output (K, T) of float32.
        candidates: Name of that input.
        chunk: Candidates a turn.

    Returns:
        A model with the same inputs and output; no candidates give an output (0, T).
    """
    graph = model.graph
    (output,) = graph.output
    steps = output.type.tensor_type.shape.dim[1].dim_value
    body = _body(graph, candidates, steps)
    # Turns: (K + chunk - 1) / chunk in whole numbers, so that the last takes what is left.
    nodes = [
        helper.make_node("Shape", [candidates], ["count"], start=0, end=1),
        helper.make_node("Add", ["count", "chunk_less_one"], ["count_and_rest"]),
        helper.make_node("Div", ["count_and_rest", "chunk"], ["turns"]),
        helper.make_node("Squeeze", ["turns"], ["turn_count"]),
        helper.make_node("Loop", ["turn_count", "", "none_scored"], [output.name], body=body),
    ]
    constants = {
        "chunk": np.array([chunk], np.int64),
        "chunk_less_one": np.array([chunk - 1], np.int64),
        "candidate_axis": np.array([0], np.int64),
        "none_scored": np.zeros((0, steps), np.float32),
    }
    stored = [numpy_helper.from_array(value, name) for name, value in constants.items()]
    outer = helper.make_graph(nodes, graph.name, [*graph.input], [output], stored)
    looped = ModelProto()
    looped.CopyFrom(model)
    looped.graph.CopyFrom(outer)
    checker.check_model(looped, full_check=True)
    return looped


def _body(graph: GraphProto, candidates: str, steps: int) -> GraphProto:
    """One turn: slice the candidates, run the graph on them, append what it gives."""
    (output,) = graph.output
    renamed = {candidates: _PART, output.name: _PART_OUTPUT}
    nodes = [
        helper.make_node("Mul", ["turn", "chunk"], ["begin"]),
        helper.make_node("Add", ["begin", "chunk"], ["end"]),
        helper.make_node("Slice", [candidates, "begin", "end", "candidate_axis"], [_PART]),
        *(_renamed(node, renamed) for node in graph.node),
        helper.make_node("Concat", ["scored_before", _PART_OUTPUT], ["scored"], axis=0),
        helper.make_node("Identity", ["go_on"], ["go_on_after"]),
    ]
    inputs = [
        helper.make_tensor_value_info("turn", TensorProto.INT64, []),
        helper.make_tensor_value_info("go_on", TensorProto.BOOL, []),
        helper.make_tensor_value_info("scored_before", TensorProto.FLOAT, [None, steps]),
    ]
    outputs = [
        helper.make_tensor_value_info("go_on_after", TensorProto.BOOL, []),
        helper.make_tensor_value_info("scored", TensorProto.FLOAT, [None, steps]),
    ]
    return helper.make_graph(nodes, "turn", inputs, outputs, [*graph.initializer])


def _renamed(node: NodeProto, names: dict[str, str]) -> NodeProto:
    copy = NodeProto()
    copy.CopyFrom(node)
    copy.input[:] = [names.get(name, name) for name in node.input]
    copy.output[:] = [names.get(name, name) for name in node.output]
    return copy
