from __future__ import annotations

import hashlib

import pytest
import torch
from torch import nn

from model_zoo.layers.resnet18 import ResNet18

TORCHVISION = "84fb10d9c6905a1cbb020b284537dc97c4f4ec55fb2a780a41152a23a2dd0e9d"
"""SHA-256 of names and shapes, a line each, of the state dict of torchvision 0.28's ResNet18."""


def parameters(module: nn.Module) -> int:
    return sum(parameter.numel() for parameter in module.parameters())


def test_published_counts() -> None:
    assert parameters(ResNet18(1000, reduction=None)) == 11_689_512
    assert parameters(ResNet18(1000)) == 11_689_512 + 89_880 == 11_779_392


def test_its_tensors_are_named_and_shaped_as_in_torchvision() -> None:
    shapes = {name: tuple(tensor.shape) for name, tensor in ResNet18(1000).state_dict().items()}
    lines = [f"{name} {shape}" for name, shape in shapes.items() if ".cbam." not in name]
    assert len(lines) == 122
    assert hashlib.sha256("\n".join(lines).encode()).hexdigest() == TORCHVISION


def test_published_weights_load_but_for_attention_and_the_last_layer() -> None:
    published = ResNet18(1000, reduction=None).state_dict()
    ours = ResNet18(40)
    for name in ("fc.weight", "fc.bias"):
        del published[name]
    result = ours.load_state_dict(published, strict=False)
    assert not result.unexpected_keys
    assert all(".cbam." in name or name.startswith("fc.") for name in result.missing_keys)


@pytest.mark.parametrize("size", [(240, 320), (120, 160)])
def test_any_size_of_picture_gives_the_outputs(size: tuple[int, int]) -> None:
    network = ResNet18(40, width=8).eval()
    assert network.trunk(torch.zeros(1, 3, 240, 320)).shape == (1, 64, 8, 10)
    assert network(torch.zeros(2, 3, *size)).shape == (2, 40)


def test_attention_is_in_every_block_before_the_addition() -> None:
    network = ResNet18(40, width=8).eval()
    gates = [name for name, _ in network.named_modules() if name.endswith("cbam")]
    assert gates == [f"layer{stage}.{block}.cbam" for stage in range(1, 5) for block in range(2)]
    block = network.layer1[0]
    gate = block.get_parameter("cbam.spatial_norm.bias")
    nn.init.constant_(gate, -50.0)  # shut: only what came in is left
    x = torch.rand(1, 8, 6, 8)
    torch.testing.assert_close(block(x), x)
