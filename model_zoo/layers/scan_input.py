"""Laser scans of a dataset as networks read them."""

from __future__ import annotations

from torch import Tensor

from graspe_data.errors import ZooError


def clipped_scan(scan: Tensor, beams: int, limit: float) -> Tensor:
    """Scale ranges to [0, 1], where 1 is ``limit`` or farther, or no return.

    Args:
        scan: float32 (B, beams), metres, inf where empty.
        beams: Rays that the network reads.
        limit: Metres.

    Raises:
        ZooError: Another number of rays.
    """
    return expect_beams(scan, beams).clamp(0.0, limit) / limit


def expect_beams(scan: Tensor, beams: int) -> Tensor:
    """The scan itself, (B, beams).

    Raises:
        ZooError: Another number of rays.
    """
    if scan.shape[1] != beams:
        raise ZooError(
            f"laser_scan: found {scan.shape[1]} rays, expected {beams}; make the model with "
            f"beams={scan.shape[1]}, or the dataset with {beams} rays."
        )
    return scan
