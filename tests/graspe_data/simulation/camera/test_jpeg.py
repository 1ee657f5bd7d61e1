"""Pictures survive JPEG with their channels in order."""

import cv2
import numpy as np
import pytest

from graspe_data.simulation.camera.develop import encode_jpeg


def test_the_channels_keep_their_order() -> None:
    rgb = np.full((48, 64, 3), (200, 120, 30), np.uint8)
    decoded = cv2.imdecode(np.frombuffer(encode_jpeg(rgb, 95), np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert decoded[..., ::-1].mean(axis=(0, 1)) == pytest.approx([200, 120, 30], abs=2)


def test_a_lower_quality_takes_fewer_bytes() -> None:
    rgb = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
    assert len(encode_jpeg(rgb, 30)) < len(encode_jpeg(rgb, 95)) / 2
