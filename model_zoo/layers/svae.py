"""The supervised variational autoencoder of a laser scan, as PAAD and the SVAE use it."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn


@dataclass(frozen=True)
class Posterior:
    """A diagonal normal distribution of codes for each scan: means, log variances, (B, L)."""

    mean: Tensor
    log_variance: Tensor

    @property
    def features(self) -> Tensor:
        """Means and log variances side by side, (B, 2 L): what a classifier reads."""
        return torch.cat((self.mean, self.log_variance), dim=1)

    def sample(self) -> Tensor:
        """Draw one code a scan, (B, L), so that gradients reach the distribution."""
        return self.mean + torch.exp(self.log_variance / 2) * torch.randn_like(self.mean)

    def divergence(self) -> Tensor:
        """Kullback-Leibler divergence from the standard normal, (B,), nats."""
        mean, log_variance = self.mean.float(), self.log_variance.float()
        return 0.5 * (mean**2 + log_variance.exp() - 1 - log_variance).sum(dim=1)


class ScanAutoencoder(nn.Module):
    """Encodes a scan and reconstructs it (tianchenji/Multimodal-SVAE and PAAD, nets/SVAE.py)."""

    def __init__(self, beams: int, hidden: int = 128, latent: int = 32) -> None:
        """Fully connected throughout.

        Args:
            beams: Rays of a scan.
            hidden: Units of the one hidden layer on either side.
            latent: Length of a code, L.
        """
        super().__init__()
        self.encoder = nn.Sequential(nn.Linear(beams, hidden), nn.ReLU())
        self.mean = nn.Linear(hidden, latent)
        self.log_variance = nn.Linear(hidden, latent)
        self.decoder = nn.Sequential(
            nn.Linear(latent, hidden), nn.ReLU(), nn.Linear(hidden, beams), nn.Sigmoid()
        )

    def encode(self, scan: Tensor) -> Posterior:
        """The codes' distribution for scans (B, beams) within [0, 1]."""
        hidden = self.encoder(scan)
        return Posterior(self.mean(hidden), self.log_variance(hidden))

    def reconstruction_error(self, scan: Tensor, code: Tensor) -> Tensor:
        """Squared error of the scans (B, beams) that codes (B, L) stand for, summed: (B,)."""
        rebuilt: Tensor = self.decoder(code)
        return (rebuilt.float() - scan).square().sum(dim=1)
