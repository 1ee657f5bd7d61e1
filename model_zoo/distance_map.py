"""A laser scan drawn as a top view: free up to the first return, blocked from there on."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from graspe_data.errors import ZooError
from model_zoo.scan_input import expect_beams

FREE, BLOCKED, UNSEEN = 1.0, 0.0, 0.5


class DistanceMap(nn.Module):
    """Raster scans into the half-plane ahead of the robot, which stands below the middle.

    The first row is the farthest, columns go from left to right; the sides of the square are as
    long as the view is deep. Each pixel looks up the ray in whose sector its centre lies
    (``polar_fill``): 1 in front of that ray's return, 0 at and behind it, 0.5 where the ray has
    none, since a ray without a return in its band of heights says nothing about the ground.
    How NMFNet draws its distance maps is not published; this rendering is ours.
    """

    ray: Tensor
    distance: Tensor

    def __init__(
        self, pixels: int, depth: float, beams: int, half_angle: float = math.pi / 2
    ) -> None:
        """Look up each pixel's ray, once.

        Args:
            pixels: Pixels of each side, P.
            depth: Metres ahead that the view reaches.
            beams: Rays of a scan, from right to left.
            half_angle: The scan covers [-half_angle, half_angle), rad.

        Raises:
            ZooError: The scan does not cover the half-plane ahead.
        """
        super().__init__()
        if half_angle < math.pi / 2:
            raise ZooError(
                f"distance map: the scan covers {2 * half_angle:.3f} rad, expected pi at least; "
                "fill the sides with inf first."
            )
        self.beams = beams
        ray, distance = _polar(pixels, depth / pixels, beams, half_angle)
        self.register_buffer("ray", ray, persistent=False)
        self.register_buffer("distance", distance, persistent=False)

    def forward(self, scan: Tensor) -> Tensor:
        """Draw scans (B, beams), metres, inf where empty: float32 (B, 1, P, P) of 0, 0.5, 1.

        Raises:
            ZooError: Another number of rays.
        """
        first = expect_beams(scan, self.beams)[:, self.ray]
        seen = torch.where(self.distance < first, FREE, BLOCKED)
        return torch.where(torch.isfinite(first), seen, UNSEEN).unsqueeze(1)


def _polar(pixels: int, cell: float, beams: int, half_angle: float) -> tuple[Tensor, Tensor]:
    """Each pixel centre's ray, int64 (P, P), and distance from the robot, (P, P) metres.

    The right half is the left one's mirror image, also where a centre lies between two rays.
    """
    steps = torch.arange(pixels, dtype=torch.float64) + 0.5
    x = (pixels - steps)[:, None] * cell
    y = (pixels / 2 - steps)[None, :] * cell
    sector = (torch.atan2(y.abs(), x) + half_angle) * (beams / (2 * half_angle))
    left = sector.floor().long().clamp(0, beams - 1)
    ray = torch.where(y > 0, left, beams - 1 - left)
    return ray, torch.hypot(x, y).float()
