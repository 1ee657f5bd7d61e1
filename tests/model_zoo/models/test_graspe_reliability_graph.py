from __future__ import annotations

import itertools
import math

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from model_zoo.models.graspe import FeatureCounts, ReliabilityGraph

COUNTS = FeatureCounts()
UNIT = st.floats(0, 1, width=32)
Case = tuple[Tensor, Tensor, Tensor]


@st.composite
def observations(draw: st.DrawFn) -> Case:
    generator = torch.Generator().manual_seed(draw(st.integers(0, 2**31)))
    features = torch.rand(2, COUNTS.nodes, generator=generator)
    if draw(st.booleans()):
        features = features.round()
    image, point = ([draw(UNIT), draw(UNIT)] for _ in range(2))
    return features, torch.tensor(image), torch.tensor(point)


def r_of_a_pair(i: int, j: int, image: float, point: float) -> float:
    """Equation (7) as it is printed, read anew."""
    sensors = {"image" if k < 40 else "point" if k < 80 else "other" for k in (i, j)}
    if "image" in sensors and "point" in sensors:
        return (point + image) / 2
    if "image" in sensors:
        return image
    return point if "point" in sensors else 1.0


def test_equation_7_pair_by_pair() -> None:
    graph = ReliabilityGraph(COUNTS, 2.0)
    found = graph.reliability_matrix(torch.tensor([0.2, 1.0]), torch.tensor([0.6, 0.3]))
    assert found.shape == (2, 120, 120)
    for row, (image, point) in enumerate([(0.2, 0.6), (1.0, 0.3)]):
        expected = [
            r_of_a_pair(i, j, image, point) for i, j in itertools.product(range(120), repeat=2)
        ]
        torch.testing.assert_close(found[row].flatten(), torch.tensor(expected))


@settings(max_examples=40, deadline=None)
@given(observations(), st.floats(0.1, 8))
def test_lemma_1_weights_are_symmetric_and_bounded(case: Case, decay: float) -> None:
    weights = ReliabilityGraph(COUNTS, decay).edge_weights(*case)
    assert torch.equal(weights, weights.mT)
    assert not weights.diagonal(dim1=1, dim2=2).any()
    edges = weights[:, ~torch.eye(COUNTS.nodes, dtype=torch.bool)]
    assert edges.max() <= 1
    assert edges.min() >= math.exp(-2 * decay) * (1 - 1e-5)


@settings(max_examples=15, deadline=None)
@given(observations())
def test_lemma_2_the_laplacian_decomposes(case: Case) -> None:
    weights = ReliabilityGraph(COUNTS, 2.0).edge_weights(*case)[0].double().numpy()
    degree = weights.sum(axis=1)
    eigenvalues, vectors = np.linalg.eigh(np.diag(degree) - weights)
    assert abs(eigenvalues[0]) < 1e-9
    assert eigenvalues[1] > 1e-3
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(COUNTS.nodes), atol=1e-9)
    scale = 1 / np.sqrt(degree)
    normalised = np.eye(COUNTS.nodes) - scale[:, None] * weights * scale
    spectrum = np.linalg.eigvalsh(normalised)
    assert spectrum[0] > -1e-9
    assert spectrum[-1] < 2 + 1e-9


@given(observations())
@settings(max_examples=10, deadline=None)
def test_no_reliability_is_full_reliability_at_twice_the_decay(case: Case) -> None:
    features, image, _ = case
    zero, one = torch.zeros_like(image), torch.ones_like(image)
    # Pairs of trajectory and velocity nodes have r = 1 whatever the sensors are worth.
    unreliable = ReliabilityGraph(COUNTS, 1.0).edge_weights(features, zero, zero)[:, :80]
    reliable = ReliabilityGraph(COUNTS, 2.0).edge_weights(features, one, one)[:, :80]
    torch.testing.assert_close(unreliable, reliable)


def test_what_ships_in_a_checkpoint_are_no_constants() -> None:
    assert not ReliabilityGraph(COUNTS, 2.0).state_dict()
