"""PAAD's fusion: picture and scan attend to each other, the path joins them before the head."""

from __future__ import annotations

import torch
from torch import Tensor, nn


class AttentionFusion(nn.Module):
    """One self-attention over two tokens, added to them, and two dense layers.

    Neither positions nor a layer normalisation, and the path takes no part in the attention
    (tianchenji/PAAD, nets/PAAD.py).
    """

    def __init__(self, features: int, heads: int, hidden: int, dropout: float, steps: int) -> None:
        """Build it.

        Args:
            features: Length of each branch's vector, F.
            heads: Of the attention; they divide F.
            hidden: Units of the first dense layer.
            dropout: After it.
            steps: Outputs, T.
        """
        super().__init__()
        self.attention = nn.MultiheadAttention(features, heads, batch_first=True)
        self.head = nn.Sequential(
            nn.Linear(3 * features, hidden),
            nn.ReLU(),
            nn.Dropout(dropout),
            nn.Linear(hidden, steps),
        )

    def scene(self, picture: Tensor, scan: Tensor) -> Tensor:
        """What all paths in a scene share: vectors (B, F) that attended to each other, (B, 2 F)."""
        tokens = torch.stack((picture, scan), dim=1)
        attended, _ = self.attention(tokens, tokens, tokens, need_weights=False)
        fused: Tensor = (attended + tokens).flatten(1)
        return fused

    def forward(self, scene: Tensor, path: Tensor) -> Tensor:
        """Outputs (K, T), not activated, of paths (K, F) in as many scenes (K, 2 F), or in one."""
        fused = torch.cat((scene.expand(path.shape[0], -1), path), dim=1)
        outputs: Tensor = self.head(fused)
        return outputs
