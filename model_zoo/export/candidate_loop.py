"""A graph over many candidates as a loop over some at a time."""

from __future__ import annotations

import numpy as np
from onnx import GraphProto, ModelProto, NodeProto, TensorProto, checker, helper, numpy_helper

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
