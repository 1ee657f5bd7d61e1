"""From raw sensor data to scores."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from graspe_data.calibration import Calibration
from graspe_data.errors import ObservationError, PlannerError
from graspe_data.sensor_data import Picture
from planners.bundle import Bundle
from planners.observe import KEPT, RowObserver
from planners.scorer import Scorer
from tests.planners.conftest import NOW, Situations
from tests.planners.tiny_bundle import HEIGHT, STEPS, WIDTH

FAN = np.array([[0.5, 0.0], [0.5, 0.5], [0.5, -0.5], [0.0, 0.5]])


def test_the_model_judges_what_is_drawn(
    bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    """The tiny model fears the left: a rotation draws nothing."""
    scores = Scorer(bundle, calibration).score(situation(), FAN)
    assert scores.success.shape == (4, STEPS)
    assert scores.success.min(axis=1) == pytest.approx([1.0, 0.1, 1.0, 1.0])
    assert 0 < scores.r_img < 1
    assert 0 <= scores.r_point <= 1


@pytest.mark.parametrize("count", [1, 2, 7, 100])
def test_a_candidate_s_score_does_not_depend_on_the_others(
    bundle: Bundle, calibration: Calibration, situation: Situations, count: int
) -> None:
    scorer = Scorer(bundle, calibration)
    scene = scorer.scene(situation())
    velocities = np.random.default_rng(0).uniform((0, -0.6), (0.6, 0.6), (count, 2))
    together = scorer.judge(scene, velocities)
    alone = [scorer.judge(scene, velocities[row : row + 1])[0] for row in range(count)]
    assert np.array_equal(together, np.stack(alone))


def test_a_model_that_ignores_candidates_gives_all_the_same(
    scene_bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    success = Scorer(scene_bundle, calibration).score(situation(grey=51), FAN).success
    assert success.shape == (4, STEPS)
    assert success == pytest.approx(0.4)


def test_a_sensor_pair_is_encoded_once(
    bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    scorer, moment = Scorer(bundle, calibration), situation()
    scene = scorer.scene(moment)
    assert scorer.scene(replace(moment, goal=(1.0, 1.0), now_ns=NOW + 1)) is scene
    assert scorer.scene(replace(moment, motions=situation(velocity=(0.1, 0)).motions)) is not scene
    assert scorer.scene(situation()) is not scene


def test_columns_are_those_of_a_row(
    bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    observer = RowObserver(bundle.contract, calibration)
    observation = observer.observe(situation())
    shapes = {name: value.shape for name, value in observation.columns.items()}
    assert shapes["image"] == (1, HEIGHT, WIDTH, 3)
    assert shapes["point_count"] == (1,)
    assert shapes["laser_scan"] == (1, 720)
    assert shapes["r_img"] == (1,)
    images = observer.trajectory_images(FAN)
    assert images.shape == (4, HEIGHT, WIDTH)
    assert images[:3].any(axis=(1, 2)).all()
    assert not images[3].any()


def test_drawing_again_draws_the_same(bundle: Bundle, calibration: Calibration) -> None:
    observer = RowObserver(bundle.contract, calibration)
    velocities = np.random.default_rng(1).uniform((0, -0.6), (0.6, 0.6), (KEPT + 50, 2))
    first = observer.trajectory_images(velocities)
    assert np.array_equal(observer.trajectory_images(velocities[::-1])[::-1], first)
    fresh = RowObserver(bundle.contract, calibration).trajectory_images(velocities[-3:])
    assert np.array_equal(fresh, first[-3:])


def test_sensor_data_that_are_not_there(
    bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    scorer = Scorer(bundle, calibration)
    with pytest.raises(PlannerError, match="no picture"):
        scorer.scene(replace(situation(), picture=None))
    with pytest.raises(PlannerError, match="no cloud"):
        scorer.scene(replace(situation(), cloud=None))


def test_a_picture_of_another_camera(
    bundle: Bundle, calibration: Calibration, situation: Situations
) -> None:
    other = Picture(NOW, "camera", np.zeros((30, 40, 3), np.uint8))
    with pytest.raises(ObservationError, match="Picture of 40x30, expected 64x48"):
        Scorer(bundle, calibration).scene(replace(situation(), picture=other))


@pytest.mark.parametrize(
    "velocities",
    [
        np.empty((0, 2)),
        np.array([[0.5, np.nan]]),
        np.array([0.5, 0.1]),
        np.full((4, 3), 0.1),
        np.full((2, 4), 0.1),
        np.full((1, 2, 2), 0.1),
        np.array(0.3),
        np.array([["fast", "slow"]]),
        None,
    ],
)
def test_candidates_that_are_none(
    bundle: Bundle, calibration: Calibration, situation: Situations, velocities: np.ndarray
) -> None:
    scorer = Scorer(bundle, calibration)
    with pytest.raises(PlannerError, match="velocities to score"):
        scorer.judge(scorer.scene(situation()), velocities)
