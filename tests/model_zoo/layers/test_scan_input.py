from __future__ import annotations

import math

import pytest
import torch

from graspe_data.errors import ZooError
from model_zoo.layers.scan_input import clipped_scan


def test_nothing_returned_reads_as_far() -> None:
    scan = torch.tensor([[math.inf, 9.0, 4.5, 0.9]])
    torch.testing.assert_close(clipped_scan(scan, 4, 4.5), torch.tensor([[1.0, 1.0, 1.0, 0.2]]))


def test_another_number_of_rays_is_refused() -> None:
    with pytest.raises(ZooError, match="found 1081 rays, expected 720"):
        clipped_scan(torch.zeros(1, 1081), 720, 4.5)
