"""The settings of an observation are declared once, and a planner does not guess them."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from graspe_data.manifest import find_manifest
from graspe_data.observation.settings import HistorySettings, ObservationManifest
from graspe_data.observation.settings import ObservationSettings as Observed
from graspe_data.robot import Robot, load_robot


@pytest.fixture
def robot() -> Robot:
    return load_robot(find_manifest("robots", "go2_livox"))


def test_what_a_manifest_says_comes_to_a_robot(robot: Robot) -> None:
    window = HistorySettings(history_steps=7, odometry_gap_s=0.4)
    observed = ObservationManifest(window=window).on_robot(robot)
    assert (observed.history_steps, observed.odometry_gap_s) == (7, 0.4)
    assert observed.picture_size == (240, 320)
    assert observed.points.rings == robot.lidar.rings
    assert observed.points.base_height == robot.base_height


@pytest.mark.parametrize("key", sorted(Observed.model_fields.keys() - {"drawn_from_behind"}))
def test_every_key_of_a_bundle_has_to_be_there(robot: Robot, key: str) -> None:
    told = ObservationManifest().on_robot(robot).model_dump(mode="json")
    assert Observed.model_validate(told).model_dump(mode="json") == told
    del told[key]
    with pytest.raises(ValidationError, match=key):
        Observed.model_validate(told)
