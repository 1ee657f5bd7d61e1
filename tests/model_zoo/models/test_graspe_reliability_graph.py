from __future__ import annotations

import itertools
import math

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from model_zoo.models.graspe import FeatureCounts, ReliabilityGraph
from tests.model_zoo.models.edge_weights import edge_weights

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
    features = torch.linspace(0, 1, COUNTS.nodes).repeat(2, 1)
    weights = ReliabilityGraph(COUNTS, 2.0)(
        features, torch.tensor([0.2, 1.0]), torch.tensor([0.6, 0.3])
    )
    # Equation (6) solved for r_ij, where |f_i - f_j| is above 0.
    distance = (features[:, :, None] - features[:, None, :]).abs()
    found = 2 + weights.log() / (2.0 * distance)
    pairs = ~torch.eye(COUNTS.nodes, dtype=torch.bool).flatten()
    for row, (image, point) in enumerate([(0.2, 0.6), (1.0, 0.3)]):
        expected = [
            r_of_a_pair(i, j, image, point) for i, j in itertools.product(range(120), repeat=2)
        ]
        torch.testing.assert_close(
            found[row].flatten()[pairs], torch.tensor(expected)[pairs], rtol=0, atol=1e-4
        )


@settings(max_examples=40, deadline=None)
@given(observations(), st.floats(0.1, 8))
def test_lemma_1_weights_are_symmetric_and_bounded(case: Case, decay: float) -> None:
    weights = edge_weights(ReliabilityGraph(COUNTS, decay), *case)
    assert torch.equal(weights, weights.mT)
    assert not weights.diagonal(dim1=1, dim2=2).any()
    edges = weights[:, ~torch.eye(COUNTS.nodes, dtype=torch.bool)]
    assert edges.max() <= 1
    assert edges.min() >= math.exp(-2 * decay) * (1 - 1e-5)


@settings(max_examples=15, deadline=None)
@given(observations())
def test_lemma_2_the_laplacian_decomposes(case: Case) -> None:
    weights = edge_weights(ReliabilityGraph(COUNTS, 2.0), *case)[0].double().numpy()
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
    unreliable = edge_weights(ReliabilityGraph(COUNTS, 1.0), features, zero, zero)[:, :80]
    reliable = edge_weights(ReliabilityGraph(COUNTS, 2.0), features, one, one)[:, :80]
    torch.testing.assert_close(unreliable, reliable)


def test_what_ships_in_a_checkpoint_are_no_constants() -> None:
    assert not ReliabilityGraph(COUNTS, 2.0).state_dict()
