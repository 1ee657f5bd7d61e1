"""AU-ROC among the candidates of one row."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.metrics import roc_auc_score

from model_zoo.evaluation.scenes import resampled_mean, scene_areas


def test_the_area_of_each_scene_is_that_of_its_judged_candidates() -> None:
    draw = np.random.default_rng(0)
    odds = draw.normal(size=(40, 6)).round(1)
    through, mask = draw.random((40, 6)) < 0.5, draw.random((40, 6)) < 0.8
    found = scene_areas(odds, through, mask)
    for row in range(40):
        judged = through[row][mask[row]]
        if judged.all() or not judged.any():
            assert np.isnan(found[row])
        else:
            assert found[row] == pytest.approx(roc_auc_score(judged, odds[row][mask[row]]))
    assert np.isnan(found).any()


def test_a_resample_weighs_each_scene_by_its_recording() -> None:
    areas, recording = np.array([0.2, 0.4, np.nan, 0.9]), np.array([0, 0, 1, 2])
    weights = np.array([[1.0, 1.0, 1.0], [2.0, 1.0, 0.0], [0.0, 3.0, 0.0]])
    found = resampled_mean(areas, recording, weights)
    assert found[:2] == pytest.approx([0.5, 0.3])
    assert np.isnan(found[2])
