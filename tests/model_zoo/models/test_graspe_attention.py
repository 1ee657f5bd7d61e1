from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import elu
from torch_geometric.nn import GATConv, GCNConv

from model_zoo.models.graspe import (
    AttentionGraphNetwork,
    AttentionGraphSettings,
    degree_scale,
)
from tests.model_zoo.models.edge_weights import edge_weights

Case = tuple[Tensor, Tensor, Tensor]


def a_case() -> Case:
    torch.manual_seed(1)
    return torch.rand(3, 120), torch.rand(3), torch.rand(3)


def by_pyg(network: AttentionGraphNetwork, case: Case) -> Tensor:
    """The same network on PyTorch Geometric's sparse layers, graph by graph."""
    first, second = GCNConv(1, 16), GCNConv(16, 16)
    attention = GATConv(16, 4, 4, edge_dim=1)
    first.load_state_dict(network.first.state_dict())
    second.load_state_dict(network.second.state_dict())
    attention.load_state_dict(network.attention.state_dict())
    weights = edge_weights(network.graph, *case)
    edges = (~torch.eye(120, dtype=torch.bool)).nonzero().t()
    rows = []
    for x, matrix in zip(case[0], weights, strict=True):
        weight = matrix[edges[0], edges[1]]
        nodes = first(x[:, None], edges, weight).relu()
        nodes = elu(attention(nodes, edges, weight[:, None]))
        rows.append(second(nodes, edges, weight).relu().flatten())
    return network.head(network.norm(torch.stack(rows)))  # type: ignore[no-any-return]


def test_the_whole_network_equals_pyg() -> None:
    network = AttentionGraphNetwork(10, AttentionGraphSettings()).eval()
    for parameter in network.parameters():
        nn.init.normal_(parameter, std=0.3)
    case = a_case()
    torch.testing.assert_close(network(*case), by_pyg(network, case), atol=1e-5, rtol=1e-5)


def test_rows_of_a_batch_do_not_mix() -> None:
    network = AttentionGraphNetwork(10, AttentionGraphSettings()).eval()
    case = a_case()
    order = torch.tensor([2, 0, 1])
    permuted = network(*(part[order] for part in case))
    torch.testing.assert_close(permuted, network(*case)[order])


def test_nodes_of_one_sensor_may_change_places_until_they_are_put_in_a_row() -> None:
    network = AttentionGraphNetwork(10, AttentionGraphSettings()).eval()
    network.head = nn.Identity()  # type: ignore[assignment]
    features, *reliabilities = a_case()
    order = torch.cat([torch.randperm(40), 40 + torch.randperm(40), 80 + torch.randperm(40)])
    nodes = network(features, *reliabilities).unflatten(1, (120, 16))
    permuted = network(features[:, order], *reliabilities).unflatten(1, (120, 16))
    torch.testing.assert_close(permuted, nodes[:, order], atol=1e-6, rtol=1e-5)


def test_each_reliability_changes_the_output() -> None:
    network = AttentionGraphNetwork(10, AttentionGraphSettings()).eval()
    features, image, point = a_case()
    before = network(features, image, point)
    assert not torch.equal(before, network(features, 1 - image, point))
    assert not torch.equal(before, network(features, image, 1 - point))


def test_every_parameter_learns() -> None:
    network = AttentionGraphNetwork(10, AttentionGraphSettings())
    network(*a_case()).square().sum().backward()
    assert all(p.grad is not None and p.grad.any() for p in network.parameters())


def between_nodes(settings: AttentionGraphSettings) -> float:
    """How far nodes differ after the attention, over how far scenes differ there."""
    torch.manual_seed(0)
    network, ones = AttentionGraphNetwork(10, settings).eval(), torch.ones(32)
    features = torch.rand(32, 120)
    adjacency = network.graph(features, ones, ones)
    scale = degree_scale(adjacency)
    with torch.no_grad():
        nodes = torch.relu(network.first(features[:, :, None], adjacency, scale))
        attended = network.attention(nodes, adjacency)
    return float(attended.std(dim=1).mean() / attended.mean(dim=1).std(dim=0).mean())


def test_nodes_stay_apart_where_a_small_lambda_makes_them_alike() -> None:
    alike = between_nodes(AttentionGraphSettings(decay=2.0, focus=None))
    assert alike < 0.5
    assert between_nodes(AttentionGraphSettings()) > 10 * alike


def test_heads_begin_with_all_nodes_and_end_with_the_nearest() -> None:
    attention = AttentionGraphNetwork(10, AttentionGraphSettings(focus=12.0)).attention
    scores = (attention.lin_edge.weight.view(1, 4, 4) * attention.att_edge).sum(dim=2)
    torch.testing.assert_close(scores[0].detach(), torch.tensor([0.0, 4.0, 8.0, 12.0]))
