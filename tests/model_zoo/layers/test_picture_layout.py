"""Convolutions of any width on several threads: oneDNN must not write past its buffers."""

from __future__ import annotations

import subprocess
import sys

import pytest
import torch

from model_zoo.layers.picture_input import laid_out, normalised_picture

TRAINED_ON_TWO_THREADS = """
import torch
from model_zoo.models.nmfnet import ResNet8
from model_zoo.layers.resnet18 import ResNet18
from model_zoo.layers.picture_input import normalised_picture

torch.set_num_threads(2)
network = {network}
pictures = torch.randint(0, 255, (3, 240, 320, 3), dtype=torch.uint8)
for _ in range(20):
    network(normalised_picture(pictures, 2)).square().mean().backward()
"""


@pytest.mark.slow
@pytest.mark.parametrize("network", ["ResNet8(3, 2)", "ResNet8(3, 12)", "ResNet18(4, 2, None)"])
def test_narrow_networks_train_on_two_threads(network: str) -> None:
    script = TRAINED_ON_TWO_THREADS.format(network=network)
    ended = subprocess.run([sys.executable, "-c", script], check=False, capture_output=True)
    assert ended.returncode == 0, ended.stderr.decode()[-2000:]


@pytest.mark.parametrize(("channels", "kept"), [(8, True), (16, True), (2, False), (12, False)])
def test_only_narrow_networks_pay_for_a_copy(channels: int, kept: bool) -> None:
    picture = normalised_picture(torch.zeros(2, 8, 8, 3, dtype=torch.uint8))
    assert (laid_out(picture, channels) is picture) == kept
    assert laid_out(picture, channels).is_contiguous() != kept
