"""A-GNN, dense against PyTorch Geometric's sparse layers; its share; PointNet's memory."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from itertools import accumulate

import torch
from torch import Tensor
from torch.nn.functional import elu
from torch.profiler import profile
from torch_geometric.nn import GATConv, GCNConv

from benchmarks.measurement import Measurement, render_table
from model_zoo.contract import SuccessModel
from model_zoo.layers.pointnet import PointNet, PointNetSettings
from model_zoo.models.graspe import AttentionGraphNetwork, AttentionGraphSettings
from model_zoo.registry import create_model

ROWS = 32
POINTS = 10_000
Features = tuple[Tensor, Tensor, Tensor]


class SparseGraphNetwork(torch.nn.Module):
    """The same layers as PyTorch Geometric has them: a batch is one graph, its edges a list."""

    def __init__(self, dense: AttentionGraphNetwork) -> None:
        super().__init__()
        self.dense = dense
        self.first, self.second = GCNConv(1, 16), GCNConv(16, 16)
        self.attention = GATConv(16, 4, 4, edge_dim=1)
        self.first.load_state_dict(dense.first.state_dict())
        self.second.load_state_dict(dense.second.state_dict())
        self.attention.load_state_dict(dense.attention.state_dict())
        row, source, target = (~torch.eye(120, dtype=torch.bool)).expand(ROWS, -1, -1).nonzero().t()
        self.edges = torch.stack([source, target]) + 120 * row
        self.places = (row * 120 + source) * 120 + target

    def forward(self, features: Tensor, r_img: Tensor, r_point: Tensor) -> Tensor:
        rows = len(features)
        edges = self.edges
        weight = self.dense.graph(features, r_img, r_point).flatten()[self.places]
        x = self.first(features.reshape(-1, 1), edges, weight).relu()
        x = self.dense.dropout(elu(self.attention(x, edges, weight[:, None])))
        x = self.second(x, edges, weight).relu()
        return self.dense.head(self.dense.norm(x.view(rows, -1)))  # type: ignore[no-any-return]


def best_ms(works: list[Callable[[], object]], rounds: int, in_a_row: int = 3) -> list[float]:
    """The least time of each, in milliseconds, taken in turn so that all meet the same load."""
    best = [float("inf")] * len(works)
    for _ in range(rounds):
        for place, work in enumerate(works):
            for _ in range(in_a_row):
                begin = time.perf_counter()
                work()
                best[place] = min(best[place], 1000 * (time.perf_counter() - begin))
    return best


def speed(quick: bool, train: bool) -> Measurement:
    """Dense against sparse, a batch of 32 graphs of 120 nodes."""
    torch.manual_seed(0)
    dense = AttentionGraphNetwork(10, AttentionGraphSettings(dropout=0.0)).train(train)
    sparse = SparseGraphNetwork(dense).train(train)
    case = torch.rand(ROWS, 120), torch.rand(ROWS), torch.rand(ROWS)
    torch.testing.assert_close(dense(*case), sparse(*case), atol=1e-5, rtol=1e-5)

    def work(network: torch.nn.Module) -> Callable[[], object]:
        if train:
            return lambda: network(*case).sum().backward()
        return lambda: network(*case)

    with torch.inference_mode(not train):
        ours, peers = best_ms([work(dense), work(sparse)], 2 if quick else 6)
    return Measurement(
        name=f"A-GNN, {'forward and backward' if train else 'inference'}, batch {ROWS}",
        value=ROWS / ours,
        unit="graphs/ms",
        peer="the same on PyG's GCNConv and GATConv",
        peer_value=ROWS / peers,
        target=None if train else 40,
        note=f"{ours:.1f} ms against {peers:.0f} ms, outputs equal to 1e-5",
    )


def share(preset: str, quick: bool) -> Measurement:
    """What A-GNN adds to an inference."""
    torch.manual_seed(0)
    observation = {
        "image": torch.randint(0, 256, (1, 240, 320, 3), dtype=torch.uint8),
        "points": torch.randn(1, POINTS, 3),
        "point_count": torch.tensor([POINTS], dtype=torch.int32),
        "velocity_history": torch.rand(1, 50, 2),
        "trajectory_image": torch.rand(1, 240, 320) > 0.9,
        "r_img": torch.rand(1),
        "r_point": torch.rand(1),
    }

    def work(model: SuccessModel) -> Callable[[], object]:
        return lambda: model(observation)

    models = [create_model(name, preset).eval() for name in ("graspe", "graspe_no_agnn")]
    with torch.inference_mode():
        with_graph, without = best_ms([work(model) for model in models], 4 if quick else 20)
    return Measurement(
        name=f"graspe, {preset}: time of an inference",
        value=with_graph,
        unit="ms",
        peer="graspe_no_agnn",
        peer_value=without,
        target=1.15,
        better="lower",
        note="one observation; the paper's: 2.19",
    )


def peak_mebibytes(chunk: int) -> float:
    """The most that one inference of PointNet on 10,000 points holds beside weights and points."""
    network = PointNet(40, PointNetSettings(chunk=chunk)).eval()
    points = torch.randn(1, POINTS, 3)
    with torch.inference_mode(), profile(profile_memory=True) as profiled:
        network(points)
    assert profiled.profiler is not None
    events = profiled.profiler.kineto_results.events()
    changes = sorted((e.start_ns(), e.nbytes()) for e in events if e.name() == "[memory]")
    return float(max(accumulate(size for _, size in changes))) / 2**20


def memory() -> Measurement:
    """PointNet in chunks against all points at once."""
    chunk = PointNetSettings().chunk
    return Measurement(
        name=f"PointNet, {POINTS:,} points: memory of an inference",
        value=peak_mebibytes(chunk),
        unit="MiB",
        peer="all points at once",
        peer_value=peak_mebibytes(POINTS),
        target=0.5,
        better="lower",
        note=f"chunks of {chunk}, beside weights and points",
    )


def run(quick: bool) -> list[Measurement]:
    """Speed on one thread, shares and memory."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        speeds = [speed(quick, train) for train in (False, True)]
        return [*speeds, *(share(preset, quick) for preset in ("small", "paper")), memory()]
    finally:
        torch.set_num_threads(threads)


if __name__ == "__main__":
    print(render_table(run("--quick" in sys.argv)))
