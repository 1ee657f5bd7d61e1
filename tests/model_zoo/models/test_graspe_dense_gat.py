from __future__ import annotations

import torch
from torch_geometric.nn import GATConv

from model_zoo.models.graspe import DenseGat


def test_it_equals_pyg_on_random_complete_graphs() -> None:
    for seed in range(20):
        torch.manual_seed(seed)
        nodes, inputs, channels, heads = 2 + 2 * seed, 3, 1 + seed % 5, 1 + seed % 4
        x = torch.randn(2, nodes, inputs)
        weights = torch.rand(2, nodes, nodes).triu(1)
        adjacency = weights + weights.mT + torch.eye(nodes)
        sparse = GATConv(inputs, channels, heads, edge_dim=1, add_self_loops=True)
        for parameter in sparse.parameters():
            torch.nn.init.normal_(parameter)
        dense = DenseGat(inputs, channels, heads)
        dense.load_state_dict(sparse.state_dict())
        found = dense(x, adjacency)
        edges = (torch.ones(nodes, nodes) - torch.eye(nodes)).nonzero().t()
        for row in range(2):
            weight = adjacency[row][edges[0], edges[1]]
            expected = sparse(x[row], edges, weight[:, None])
            torch.testing.assert_close(found[row], expected, atol=1e-5, rtol=1e-5)


def test_weights_learned_to_extremes_stay_finite() -> None:
    torch.manual_seed(0)
    dense = DenseGat(3, 4, 4)
    for parameter in dense.parameters():
        torch.nn.init.normal_(parameter, std=4)
    x, weights = torch.randn(1, 12, 3), torch.rand(1, 12, 12).triu(1)
    adjacency = weights + weights.mT + torch.eye(12)
    with torch.no_grad():
        in_place = dense(x, adjacency)
    assert in_place.isfinite().all()
    assert torch.equal(in_place, dense(x, adjacency))


def test_its_scores_are_the_largest_tensor() -> None:
    dense = DenseGat(16, 4, 4)
    sizes: list[int] = []
    hooks = torch.autograd.graph.saved_tensors_hooks(
        lambda tensor: sizes.append(tensor.numel()) or tensor,  # type: ignore[func-returns-value]
        lambda tensor: tensor,
    )
    adjacency = torch.rand(2, 120, 120)
    with hooks:
        dense(torch.randn(2, 120, 16), adjacency + adjacency.mT)
    assert max(sizes) == 2 * 4 * 120 * 120
