"""Parity: what onnxruntime makes of the graphs against what torch makes of the model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
import onnxruntime
import torch
from numpy.typing import NDArray

from graspe_data.arrays import Floats32
from graspe_data.bundle_contract import BundleContract
from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from graspe_data.progress import Progress
from model_zoo.checkpoints import Checkpoint
from model_zoo.export.graphs import CANDIDATES, Graphs
from model_zoo.export.scenes import Columns, Kind, SceneRow

COUNTS = (1, 2, 7, 100)
"""Candidates scored at once in the first scene; in the others it is ``USUAL_COUNT`` of them."""
USUAL_COUNT = 7
_ROWS_AT_ONCE = 10
_ERRORS_ONLY = 3


class Case(Settings):
    """A scene with so many candidates; the largest difference of any of its probabilities."""

    scene: str
    kind: Kind
    candidates: int
    difference: float


class ParityReport(Settings):
    """The content of ``parity.json``.

    Attributes:
        tolerance: Of any difference, absolute, of probabilities.
        largest_difference: Of all cases.
        cases: What was tried. ``recorded.npz`` has the inputs as ``<scene>/<input>`` and the first
            of the candidates in ``trajectory_image``, and torch's output as
            ``<scene>/success_<candidates>``.
        versions: Of the packages that were compared.
    """

    tolerance: float
    largest_difference: float
    cases: tuple[Case, ...]
    versions: Mapping[str, str]


@dataclass(frozen=True)
class Parity:
    """A report, and the arrays that it is about, by their names in ``recorded.npz``."""

    report: ParityReport
    recorded: dict[str, NDArray[np.generic]]


def check_parity(
    checkpoint: Checkpoint,
    graphs: Graphs,
    contract: BundleContract,
    scenes: Sequence[SceneRow],
    candidates: NDArray[np.uint8],
    progress: Progress,
) -> Parity:
    """Compare the graphs with the model as it is evaluated, row by row.

    Args:
        checkpoint: The model.
        graphs: Made from it.
        contract: Of the bundle.
        scenes: To try.
        candidates: Trajectory images (K, H, W), of which the first are tried.
        progress: Is told of every case.

    Raises:
        ZooError: A difference is above the tolerance; the text names the worst case.
    """
    runtime = _Runtime(graphs, contract)
    cases: list[Case] = []
    recorded: dict[str, NDArray[np.generic]] = {}
    if contract.uses_candidates:
        recorded[CANDIDATES] = candidates
    cases_to_try = list(_cases(scenes, contract))
    progress.start("cases", len(cases_to_try))
    for scene, count in cases_to_try:
        expected = _predicted(checkpoint, scene.columns, candidates[:count])
        found = runtime.run(scene.columns, candidates[:count])
        cases.append(_case(scene, count, expected, found))
        recorded |= _recorded(scene, f"{contract.output.name}_{count}", expected)
        progress.advance(f"{scene.name}, {count} candidates")
    return Parity(_report(cases, contract), recorded)


class _Runtime:
    """The two graphs in onnxruntime, on the CPU."""

    def __init__(self, graphs: Graphs, contract: BundleContract) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = torch.get_num_threads()
        options.log_severity_level = _ERRORS_ONLY
        self._encode, self._score = (
            onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])
            for graph in (graphs.encode, graphs.score)
        )
        self._contract = contract

    def run(self, scene: Columns, candidates: NDArray[np.uint8]) -> Floats32:
        contract = self._contract
        columns = {**scene, CANDIDATES: candidates}
        encoded = self._encode.run(
            [tensor.name for tensor in contract.features],
            {tensor.name: columns[tensor.name] for tensor in contract.encode_inputs},
        )
        features = zip((tensor.name for tensor in contract.features), encoded, strict=True)
        own = {tensor.name: columns[tensor.name] for tensor in contract.score_inputs}
        (success,) = self._score.run([contract.output.name], {**dict(features), **own})
        return np.asarray(success, np.float32)


def _cases(scenes: Sequence[SceneRow], contract: BundleContract) -> Iterator[tuple[SceneRow, int]]:
    for place, scene in enumerate(scenes):
        counts = COUNTS if place == 0 else (USUAL_COUNT,)
        yield from ((scene, count) for count in (counts if contract.uses_candidates else (1,)))


def _predicted(checkpoint: Checkpoint, scene: Columns, candidates: NDArray[np.uint8]) -> Floats32:
    """As a dataset's rows are predicted: the scene beside each of the candidates."""
    parts = []
    for begin in range(0, len(candidates), _ROWS_AT_ONCE):
        part = candidates[begin : begin + _ROWS_AT_ONCE]
        rows: dict[str, Any] = {
            name: torch.from_numpy(np.repeat(column, len(part), axis=0))
            for name, column in scene.items()
            if name != CANDIDATES
        }
        rows[CANDIDATES] = torch.from_numpy(part)
        parts.append(checkpoint.predict(rows).numpy())
    return np.concatenate(parts)


def _case(scene: SceneRow, count: int, expected: Floats32, found: Floats32) -> Case:
    same = expected.shape == found.shape and np.isfinite(found).all()
    difference = float(np.abs(found - expected).max()) if same else 1.0
    return Case(scene=scene.name, kind=scene.kind, candidates=count, difference=difference)


def _recorded(scene: SceneRow, output: str, expected: Floats32) -> dict[str, NDArray[np.generic]]:
    """A scene's inputs and what torch gives, by their names in ``recorded.npz``."""
    columns = {name: column for name, column in scene.columns.items() if name != CANDIDATES}
    return {f"{scene.name}/{name}": array for name, array in {**columns, output: expected}.items()}


def _report(cases: Sequence[Case], contract: BundleContract) -> ParityReport:
    report = ParityReport(
        tolerance=contract.parity.absolute,
        largest_difference=max(case.difference for case in cases),
        cases=tuple(cases),
        versions={name: version(name) for name in ("torch", "onnx", "onnxruntime")},
    )
    _judge(report, contract)
    return report


def _judge(report: ParityReport, contract: BundleContract) -> None:
    worst = max(report.cases, key=lambda case: case.difference)
    if worst.difference > report.tolerance:
        raise ZooError(
            f"{contract.model}: onnxruntime and torch differ by {worst.difference:.2g} in a "
            f"probability (scene {worst.scene}, {worst.candidates} candidates), allowed is "
            f"{report.tolerance:g}. No bundle was written; use the tested versions of "
            "requirements.txt."
        )
