from __future__ import annotations

import torch

from model_zoo.layers.path_branch import PathBranch


def test_parameters_and_feature_map_of_the_published_branch() -> None:
    branch = PathBranch(128, 320)
    convolutions = sum(p.numel() for p in branch.convolutions.parameters())
    dense = sum(p.numel() for p in branch.dense.parameters())
    assert (convolutions, dense) == (5_888, 41_024)
    drawing = torch.zeros(2, 240, 320, dtype=torch.bool)
    assert branch.feature_map(drawing).shape == (2, 32, 4, 5)
    assert branch(drawing).shape == (2, 64)


def test_half_size_drawings_fit() -> None:
    drawing = torch.zeros(2, 240, 320, dtype=torch.uint8)
    assert PathBranch(128, 320, shrink=2)(drawing).shape == (2, 64)


def test_only_the_lower_rows_are_read() -> None:
    branch = PathBranch(128, 320)
    drawing = torch.zeros(1, 240, 320, dtype=torch.bool)
    sky, ground = drawing.clone(), drawing.clone()
    sky[:, :112], ground[:, 112:] = True, True
    empty = branch.feature_map(drawing)
    assert torch.equal(branch.feature_map(sky), empty)
    assert not torch.equal(branch.feature_map(ground), empty)
