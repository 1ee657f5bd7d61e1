"""One ONNX graph behind its part of a bundle's contract."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NoReturn

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from graspe_data.bundle_contract import GraphTensor
from graspe_data.errors import PlannerError

Arrays = Mapping[str, NDArray[np.generic]]

_ANOTHER_PROCESS = (
    "the bundle was loaded in another process, and answers only there: call load_bundle in the "
    "process that asks it, after the fork."
)
_ERRORS_ONLY = 3
_PROVIDERS = ["CPUExecutionProvider"]
_WEIGHTS_FOLDER = "session.model_external_initializers_file_folder_path"
_DTYPES = {
    "bool": "tensor(bool)",
    "uint8": "tensor(uint8)",
    "int32": "tensor(int32)",
    "int64": "tensor(int64)",
    "float32": "tensor(float)",
}


class Graph:
    """Runs one graph; what goes in and comes out is what the contract says.

    It has a thread of its own: a session that takes subnormal numbers for 0 makes its thread do so
    in all that it computes from then on, and that would be the caller's. It answers in the process
    that made it: neither its thread nor those of onnxruntime go along with a fork.
    """

    def __init__(
        self,
        where: str,
        content: bytes,
        inputs: Sequence[GraphTensor],
        outputs: Sequence[GraphTensor],
        threads: int,
    ) -> None:
        """Start a session on the CPU.

        Args:
            where: The graph's file, named in errors.
            content: The graph.
            inputs: What it takes.
            outputs: What it gives.
            threads: Of one call.

        Raises:
            PlannerError: It is no graph that runs here, or its inputs and outputs are not those
                of the contract.
        """
        self._where, self._inputs, self._outputs = where, tuple(inputs), tuple(outputs)
        self._pid = os.getpid()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="onnxruntime")
        self._session = self._thread.submit(_session, where, content, threads).result()
        found = {
            "inputs": (self._session.get_inputs(), inputs),
            "outputs": (self._session.get_outputs(), outputs),
        }
        for side, (nodes, tensors) in found.items():
            _compare(where, side, nodes, tensors)

    def run(self, arrays: Arrays) -> dict[str, NDArray[np.generic]]:
        """Run the graph once.

        Args:
            arrays: An array for every input, by name; others are ignored.

        Raises:
            PlannerError: An input is missing or has another dtype or shape than the contract's,
                the graph fails, or it does not give what the contract says; or it was made in
                another process.
        """
        self.check_process()
        feed = {tensor.name: self._checked(tensor, arrays) for tensor in self._inputs}
        names = [tensor.name for tensor in self._outputs]
        try:
            values = self._thread.submit(self._session.run, names, feed).result()
        except Exception as error:  # onnxruntime's errors have no common base
            raise PlannerError(f"{self._where}: the graph fails: {error}") from error
        given = dict(zip(names, values, strict=True))
        return {tensor.name: self._checked(tensor, given) for tensor in self._outputs}

    def check_process(self) -> None:
        """Refuse a process that was forked since.

        Raises:
            PlannerError: The graph was made in another process.
        """
        if self._pid != os.getpid():
            raise PlannerError(f"{self._where}: {_ANOTHER_PROCESS}")

    def __reduce__(self) -> NoReturn:
        """Refuse to be sent elsewhere, which no session can."""
        raise PlannerError(f"{self._where}: {_ANOTHER_PROCESS}")

    def _checked(self, tensor: GraphTensor, arrays: Arrays) -> NDArray[np.generic]:
        array = arrays.get(tensor.name)
        if array is None:
            raise PlannerError(f"{self._where}: {tensor.name} is missing.")
        fits = len(array.shape) == len(tensor.shape) and all(
            expected in ("K", found)
            for found, expected in zip(array.shape, tensor.shape, strict=True)
        )
        if array.dtype != np.dtype(tensor.dtype) or not fits:
            raise PlannerError(
                f"{self._where}: {tensor.name} is {array.dtype} {array.shape}, by the contract "
                f"{tensor.dtype} {tensor.shape}."
            )
        return array


def _compare(where: str, side: str, nodes: Sequence[Any], tensors: Sequence[GraphTensor]) -> None:
    """Refuse a graph whose inputs or outputs have other names, dtypes or fixed sizes."""
    names, expected = (sorted(each.name for each in some) for some in (nodes, tensors))
    if names != expected:
        raise PlannerError(
            f"{where}: {side} {', '.join(names)}, by its contract {', '.join(expected)}. "
            "Export the bundle again."
        )
    by_name = {node.name: node for node in nodes}
    for tensor in tensors:
        node = by_name[tensor.name]
        sizes = list(zip(node.shape, tensor.shape, strict=False))
        fits = len(node.shape) == len(tensor.shape) and all(
            found == size or not isinstance(found, int) for found, size in sizes
        )
        if node.type != _DTYPES[tensor.dtype] or not fits:
            raise PlannerError(
                f"{where}: {tensor.name} is {node.type} {tuple(node.shape)}, by its contract "
                f"{tensor.dtype} {tensor.shape}. Export the bundle again."
            )


def _session(where: str, content: bytes, threads: int) -> Any:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = _ERRORS_ONLY
    # Weights and activations near 1e-40 say nothing and are computed many times more slowly.
    options.add_session_config_entry("session.set_denormal_as_zero", "1")
    try:
        with tempfile.TemporaryDirectory() as nothing:
            # Weights that the graph names in other files are under no seal: there are none.
            options.add_session_config_entry(_WEIGHTS_FOLDER, nothing)
            return onnxruntime.InferenceSession(content, options, providers=_PROVIDERS)
    except Exception as error:  # onnxruntime's errors have no common base
        raise PlannerError(
            f"{where}: onnxruntime {onnxruntime.__version__} cannot run it: {error}"
        ) from error
