"""Pictures and drawings of a dataset as networks read them."""

from __future__ import annotations

from functools import reduce

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d

IMAGENET_MEAN = (0.485, 0.456, 0.406)
IMAGENET_STANDARD_DEVIATION = (0.229, 0.224, 0.225)


def normalised_picture(image: Tensor, shrink: int = 1) -> Tensor:
    """Scale colours to the mean and deviation that ImageNet has, as its trained networks expect.

    Args:
        image: uint8 (B, H, W, 3), RGB.
        shrink: Pixels of each side of the squares that are averaged first.

    Returns:
        float32 (B, 3, H / shrink, W / shrink).
    """
    picture = image.permute(0, 3, 1, 2).float()
    picture = avg_pool2d(picture, shrink) if shrink > 1 else picture
    mean = torch.tensor(IMAGENET_MEAN, device=image.device)[:, None, None]
    deviation = torch.tensor(IMAGENET_STANDARD_DEVIATION, device=image.device)[:, None, None]
    return (picture / 255 - mean) / deviation


def laid_out(picture: Tensor, channels: int) -> Tensor:
    """A picture (B, C, H, W) in the memory layout in which a convolution may take it.

    Pictures come with their channels last, which is faster. oneDNN's backward pass of strided
    convolutions then writes past its buffers, on several threads, where the number of channels is
    no multiple of eight: such networks take their pictures plane by plane.

    Args:
        picture: In any layout.
        channels: That the first convolution makes.
    """
    return picture if channels % 8 == 0 else picture.contiguous()


def lower_drawing(trajectory_image: Tensor, rows: int, shrink: int = 1) -> Tensor:
    """The lower rows of drawings, in which a shrunk line stays a line.

    Args:
        trajectory_image: (B, H, W), bool or 0 and 1.
        rows: How many of its rows, from the lower edge.
        shrink: Pixels of each side of the squares of which the largest is kept.

    Returns:
        float32 (B, 1, rows / shrink, W / shrink), 0 and 1.
    """
    return shrunk_drawing(trajectory_image[:, -rows:], shrink)[:, None]


def shrunk_drawing(trajectory_image: Tensor, shrink: int) -> Tensor:
    """Drawings of which squares of ``shrink`` pixels a side become one, the largest of them.

    Rows first, then columns: on a CPU a sixth of the time of a max-pooling.

    Args:
        trajectory_image: (B, H, W), bool or 0 and 1; what is left over at the far edges is cut.
        shrink: At least 1.

    Returns:
        float32 (B, H / shrink, W / shrink), 0 and 1.
    """
    height, width = (side // shrink * shrink for side in trajectory_image.shape[1:])
    rows = (trajectory_image[:, first:height:shrink].float() for first in range(shrink))
    drawing = reduce(torch.maximum, rows)
    columns = (drawing[:, :, first:width:shrink] for first in range(shrink))
    return reduce(torch.maximum, columns)
