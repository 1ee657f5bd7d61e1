"""PAAD's branch for the planned path, drawn into the picture."""

from __future__ import annotations

from torch import Tensor, nn

from model_zoo.layers.picture_input import lower_drawing


class PathBranch(nn.Module):
    """Three convolutions, three poolings and a dense layer (tianchenji/PAAD, nets/PAAD.py).

    A drawing of 128 x 320 becomes 32 x 4 x 5 features.
    """

    def __init__(self, height: int, width: int, shrink: int = 1, features: int = 64) -> None:
        """Build it for drawings of one size.

        Args:
            height: Rows of the trajectory image that are read, from its lower edge; PAAD reads
                128 of 240, from eight rows above a level camera's horizon.
            width: Columns of the trajectory image.
            shrink: Pixels of each side of the squares of which the drawing keeps the largest.
            features: Length of the branch's vector.
        """
        super().__init__()
        self.rows, self.shrink = height, shrink
        self.convolutions = nn.Sequential(
            *_convolution(1, 8), nn.MaxPool2d((1, 2)),
            *_convolution(8, 16), nn.MaxPool2d(2),
            *_convolution(16, 32), nn.MaxPool2d(2),
        )  # fmt: skip
        pixels = _rows_after(height // shrink) * _columns_after(width // shrink)
        self.dense = nn.Sequential(nn.Flatten(), nn.Linear(32 * pixels, features), nn.ReLU())

    def forward(self, trajectory_image: Tensor) -> Tensor:
        """Features (B, F) of trajectory images (B, H, W), bool or 0 and 1."""
        vector: Tensor = self.dense(self.feature_map(trajectory_image))
        return vector

    def feature_map(self, trajectory_image: Tensor) -> Tensor:
        """What the convolutions make of the lower rows, (B, 32, h, w)."""
        drawing = lower_drawing(trajectory_image, self.rows, self.shrink)
        maps: Tensor = self.convolutions(drawing)
        return maps


def check_path_rows(rows: int, height: int) -> None:
    """Refuse to read more rows than the trajectory image has.

    Raises:
        ValueError: It says how many there are.
    """
    if rows > height:
        raise ValueError(f"path_rows {rows} are more than the {height} rows of the picture")


def _convolution(before: int, after: int) -> tuple[nn.Module, nn.Module]:
    return nn.Conv2d(before, after, 3, stride=2, padding=1), nn.ReLU()


def _rows_after(rows: int) -> int:
    halved = (rows + 1) // 2
    for _ in range(2):
        halved = (halved + 1) // 2 // 2
    return halved


def _columns_after(columns: int) -> int:
    for _ in range(3):
        columns = (columns + 1) // 2 // 2
    return columns
