"""A scene encoded once, and many candidates in it: the same as so many rows of a dataset."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch

from model_zoo.contract import Observation, SuccessModel
from model_zoo.registry import MODELS, create_model

Observe = Callable[[int], Observation]
CANDIDATES = 5


@pytest.fixture(params=MODELS)
def model(request: pytest.FixtureRequest) -> SuccessModel:
    return create_model(request.param, "small").eval()


def test_one_scene_serves_all_candidates(model: SuccessModel, observe: Observe) -> None:
    scene = dict(observe(1))
    images = observe(CANDIDATES)["trajectory_image"]
    rows = {name: column.expand(CANDIDATES, *column.shape[1:]) for name, column in scene.items()}
    with torch.inference_mode():
        expected = model.logits(rows | {"trajectory_image": images})
        found = model.score(model.encode(scene), scene | {"trajectory_image": images})
    several = "trajectory_image" in model.columns
    assert found.shape == (CANDIDATES if several else 1, model.horizon)
    torch.testing.assert_close(found.expand_as(expected), expected, atol=1e-5, rtol=1e-5)


def test_every_column_belongs_to_the_scene_or_to_candidates(model: SuccessModel) -> None:
    assert set(model.candidate_columns) <= {"trajectory_image", "r_img", "r_point"}
    assert sorted((*model.scene_columns, *model.candidate_columns)) == sorted(model.columns)


def test_each_half_reads_its_own_columns_alone(model: SuccessModel, observe: Observe) -> None:
    observation = observe(2)
    scene = {name: observation[name] for name in model.scene_columns}
    candidates = {name: observation[name] for name in model.candidate_columns}
    with torch.inference_mode():
        found = model.score(model.encode(scene), candidates)
        assert torch.equal(found, model.logits(observation))
