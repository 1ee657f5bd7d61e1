from __future__ import annotations

import math

import pytest
import torch
from torch.distributions import Independent, Normal, kl_divergence

from model_zoo.models.paad import Posterior, ScanAutoencoder


def test_parameter_counts_of_the_published_sizes() -> None:
    paad = ScanAutoencoder(1081)
    decoder = sum(p.numel() for p in paad.decoder.parameters())
    total = sum(p.numel() for p in paad.parameters())
    assert (total - decoder, decoder) == (146_752, 143_673)
    svae = ScanAutoencoder(1080, latent=2)
    classifier = torch.nn.Sequential(torch.nn.Linear(10, 64), torch.nn.Linear(64, 4))
    both = sum(p.numel() for part in (svae, classifier) for p in part.parameters())
    assert both == 279_552


def test_divergence_is_torchs() -> None:
    torch.manual_seed(0)
    posterior = Posterior(torch.randn(5, 7), torch.randn(5, 7))
    normal = Normal(posterior.mean, torch.exp(posterior.log_variance / 2))
    standard = Normal(torch.zeros(5, 7), torch.ones(5, 7))
    expected = kl_divergence(Independent(normal, 1), Independent(standard, 1))
    torch.testing.assert_close(posterior.divergence(), expected)


def test_samples_have_the_posteriors_moments() -> None:
    torch.manual_seed(0)
    posterior = Posterior(torch.full((20_000, 1), 2.0), torch.full((20_000, 1), math.log(9.0)))
    codes = posterior.sample()
    assert codes.mean().item() == pytest.approx(2, abs=0.1)
    assert codes.std().item() == pytest.approx(3, abs=0.1)


def test_features_are_means_then_log_variances() -> None:
    posterior = ScanAutoencoder(72).encode(torch.rand(3, 72))
    assert posterior.features.shape == (3, 64)
    assert torch.equal(posterior.features[:, :32], posterior.mean)


def test_the_error_sums_over_the_beams() -> None:
    coder = ScanAutoencoder(720)
    torch.nn.init.zeros_(coder.decoder[2].weight)  # type: ignore[arg-type]
    torch.nn.init.zeros_(coder.decoder[2].bias)  # type: ignore[arg-type]
    error = coder.reconstruction_error(torch.ones(2, 720), torch.zeros(2, 32))
    assert error.tolist() == [180.0, 180.0]
