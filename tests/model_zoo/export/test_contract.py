"""What a contract says beside its checkpoint."""

from __future__ import annotations

import pytest

from model_zoo.export.contract import decision_weights


def test_the_published_weights() -> None:
    weights = decision_weights(10)
    published = [0.1246, 0.1184, 0.1125, 0.1068, 0.1015, 0.0964, 0.0916, 0.0870, 0.0827, 0.0785]
    assert weights.sum() == pytest.approx(1)
    assert weights == pytest.approx(published, abs=5e-5)
