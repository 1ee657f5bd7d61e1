"""A bundle, ready to score."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from graspe_data.bundle_contract import (
    BUNDLE,
    CONTRACT_FILE,
    ENCODE_GRAPH,
    SCORE_GRAPH,
    BundleContract,
)
from graspe_data.documents import parse_document
from graspe_data.errors import PlannerError
from planners.graph import Arrays, Graph

MOST_THREADS = 256


@dataclass(frozen=True)
class Bundle:
    """A model's two graphs and their contract; see ``load_bundle``."""

    path: Path
    contract: BundleContract
    encode_graph: Graph
    score_graph: Graph

    def check_process(self) -> None:
        """Refuse a process that was forked since the bundle was loaded; see ``Graph``.

        Raises:
            PlannerError: The bundle answers in another process alone.
        """
        self.encode_graph.check_process()

    def encode(self, observation: Arrays) -> Arrays:
        """Features of one observation.

        Args:
            observation: Columns with a leading axis of 1, at least those of ``encode_inputs``.

        Raises:
            PlannerError: A column is missing or not as the contract has it.
        """
        return self.encode_graph.run(observation)

    def score(self, features: Arrays, candidates: Arrays) -> NDArray[np.float32]:
        """Probabilities of success.

        Args:
            features: Of ``encode``.
            candidates: Arrays of ``score_inputs``, K candidates in one call.

        Returns:
            float32 (K, T), 1 = success; (1, T) for a model that does not look at candidates.

        Raises:
            PlannerError: An input is not as the contract has it, or an output is no probability.
        """
        name = self.contract.output.name
        success = np.asarray(self.score_graph.run({**features, **candidates})[name], np.float32)
        number = self._number(candidates)
        if len(success) != number:
            raise PlannerError(
                f"{self.path / SCORE_GRAPH}: {name} has {len(success)} rows for {number} "
                "candidates. Export the bundle again."
            )
        if not np.all((success >= 0) & (success <= 1)):
            raise PlannerError(f"{self.path / SCORE_GRAPH}: {name} is not within 0..1.")
        return success

    def _number(self, candidates: Arrays) -> int:
        """How many rows the scores of candidates have."""
        inputs = self.contract.score_inputs if self.contract.uses_candidates else ()
        sizes = [len(candidates[tensor.name]) for tensor in inputs if "K" in tensor.shape]
        return max(sizes, default=1)


def load_bundle(path: Path | str, threads: int = 2) -> Bundle:
    """Load a bundle that `graspe export` wrote.

    All files are checked against the bundle's seal before any is used.

    Args:
        path: Its folder.
        threads: Of one call of a graph.

    Raises:
        PlannerError: Names the file that is missing, damaged or not as the contract says.
    """
    if type(threads) is not int or not 1 <= threads <= MOST_THREADS:
        raise PlannerError(
            f"threads is {threads!r}, and must be a whole number from 1 to {MOST_THREADS}."
        )
    path = Path(path)
    files = BUNDLE.read(path, (CONTRACT_FILE, ENCODE_GRAPH, SCORE_GRAPH))
    contract = parse_document(
        files[CONTRACT_FILE], BundleContract, path / CONTRACT_FILE, PlannerError, BUNDLE.remedy
    )
    encode = Graph(
        str(path / ENCODE_GRAPH),
        files[ENCODE_GRAPH],
        contract.encode_inputs,
        contract.features,
        threads,
    )
    score = Graph(
        str(path / SCORE_GRAPH),
        files[SCORE_GRAPH],
        (*contract.features, *contract.score_inputs),
        (contract.output,),
        threads,
    )
    return Bundle(path, contract, encode, score)
