"""Scoring candidates by a bundle's graphs: one, a hundred in one call, a hundred one by one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import onnxruntime
import torch

from benchmarks.bench_agnn import best_ms
from benchmarks.measurement import Measurement, render_table
from model_zoo.export.graphs import export_graphs
from model_zoo.registry import create_model

CANDIDATES = 100
THREADS = 2


class Planning:
    """The two graphs of a model with random weights, and one observation."""

    def __init__(self, model: str, preset: str) -> None:
        torch.manual_seed(0)
        network = create_model(model, preset).eval()
        self.observation: dict[str, torch.Tensor] = {
            "image": torch.randint(0, 256, (1, 240, 320, 3), dtype=torch.uint8),
            "points": torch.randn(1, 10_000, 3),
            "point_count": torch.tensor([10_000], dtype=torch.int32),
            "laser_scan": torch.rand(1, 720) * 10,
            "velocity_history": torch.rand(1, 50, 2),
            "trajectory_image": torch.zeros((1, 240, 320), dtype=torch.uint8),
            "r_img": torch.rand(1),
            "r_point": torch.rand(1),
        }
        graphs = export_graphs(network, 1.0, self.observation)
        self.features = list(graphs.features)
        self.encode, self.score = session(graphs.encode), session(graphs.score)
        self.scene = self._columns(network.scene_columns)
        self.rest = self._columns(network.candidate_columns)
        rows, columns = np.ogrid[:240, :320]
        slopes = np.linspace(-0.5, 0.5, CANDIDATES)[:, None, None]
        path = np.abs(columns - 160 + slopes * (240 - rows)) < 30
        self.candidates = (path & (rows > 120)).astype(np.uint8)

    def ask(self, candidates: int) -> None:
        """Encode the observation and score that many candidates in one call."""
        features = dict(zip(self.features, self.encode.run(None, self.scene), strict=True))
        images = self.candidates[:candidates]
        self.score.run(None, {**features, **self.rest, "trajectory_image": images})

    def ask_in_turn(self, candidates: int) -> None:
        """Encode and score for each candidate anew, as a planner without bundles would."""
        for _ in range(candidates):
            self.ask(1)

    def _columns(self, names: tuple[str, ...]) -> dict[str, Any]:
        return {name: self.observation[name].numpy() for name in names}


def session(graph: bytes) -> Any:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = THREADS
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])


def measure(preset: str, quick: bool) -> list[Measurement]:
    planning = Planning("graspe", preset)
    tried = 3 if quick else 10
    works: list[Callable[[], object]] = [
        lambda: planning.ask(1),
        lambda: planning.ask(CANDIDATES),
        lambda: planning.ask_in_turn(tried),
    ]
    one, together, some = best_ms(works, 3 if quick else 6, in_a_row=2)
    in_turn = some * CANDIDATES / tried
    printed = preset == "paper"
    return [
        Measurement(
            name=f"graspe, {preset}: {CANDIDATES} candidates in one call",
            value=together,
            unit="ms",
            peer="1 candidate",
            peer_value=one,
            target=2 if printed else None,
            better="lower",
            note=f"onnxruntime, {THREADS} threads, encode and score",
        ),
        Measurement(
            name=f"graspe, {preset}: {CANDIDATES} candidates one by one",
            value=in_turn,
            unit="ms",
            peer="in one call",
            peer_value=together,
            target=20 if printed else None,
            note=f"from {tried} in a row",
        ),
    ]


def run(quick: bool) -> list[Measurement]:
    """Both presets."""
    return [result for preset in ("paper", "small") for result in measure(preset, quick)]


if __name__ == "__main__":
    print(render_table(run("--quick" in sys.argv)))
