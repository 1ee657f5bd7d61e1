from __future__ import annotations

import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.nn.functional import max_pool2d

from model_zoo.layers.picture_input import lower_drawing, normalised_picture, shrunk_drawing


def test_colours_are_normalised_one_by_one() -> None:
    image = torch.tensor([0, 255, 51], dtype=torch.uint8).expand(1, 1, 1, 3)
    expected = torch.tensor([-0.485 / 0.229, 0.544 / 0.224, (0.2 - 0.406) / 0.225])
    torch.testing.assert_close(normalised_picture(image).flatten(), expected)


def test_shrinking_averages_squares() -> None:
    image = torch.randint(0, 256, (1, 6, 8, 3), dtype=torch.uint8)
    whole, half = normalised_picture(image), normalised_picture(image, 2)
    assert half.shape == (1, 3, 3, 4)
    torch.testing.assert_close(half[0, :, 0, 0], whole[0, :, :2, :2].mean((1, 2)))


def test_the_lower_rows_of_a_drawing_keep_its_lines() -> None:
    drawing = torch.zeros(1, 6, 8, dtype=torch.bool)
    drawing[0, 0] = True
    drawing[0, 3, 5] = True
    lower = lower_drawing(drawing, 4, 2)
    assert lower.dtype == torch.float32
    assert lower.tolist() == [[[[0, 0, 1, 0], [0, 0, 0, 0]]]]


@settings(max_examples=25, deadline=None)
@given(st.integers(4, 20), st.integers(4, 20), st.integers(1, 4), st.integers(0, 99))
def test_a_shrunk_drawing_is_the_largest_of_each_square(
    height: int, width: int, shrink: int, seed: int
) -> None:
    generator = torch.Generator().manual_seed(seed)
    drawing = torch.rand(3, height, width, generator=generator) < 0.2
    assert torch.equal(shrunk_drawing(drawing, shrink), max_pool2d(drawing.float(), shrink))
