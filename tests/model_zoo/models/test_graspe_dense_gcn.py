from __future__ import annotations

import torch
from torch_geometric.nn import GCNConv

from model_zoo.models.graspe import DenseGcn, degree_scale


def test_it_equals_pyg_on_random_graphs() -> None:
    for seed in range(20):
        torch.manual_seed(seed)
        nodes, inputs, outputs = 3 + seed, 1 + seed % 4, 5
        x = torch.randn(2, nodes, inputs)
        weights = torch.rand(2, nodes, nodes).triu(1) * (torch.rand(2, nodes, nodes) < 0.7)
        weights = weights + weights.mT
        sparse = GCNConv(inputs, outputs)
        torch.nn.init.normal_(sparse.bias)
        dense = DenseGcn(inputs, outputs)
        dense.load_state_dict(sparse.state_dict())
        adjacency = weights + torch.eye(nodes)
        found = dense(x, adjacency, degree_scale(adjacency))
        for row in range(2):
            edges = weights[row].nonzero().t()
            expected = sparse(x[row], edges, weights[row][edges[0], edges[1]])
            torch.testing.assert_close(found[row], expected, atol=1e-5, rtol=1e-5)
