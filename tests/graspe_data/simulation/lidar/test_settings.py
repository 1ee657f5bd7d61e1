"""Settings of a lidar: what is refused, and how it is said."""

from __future__ import annotations

import pytest

from graspe_data.errors import ManifestError
from graspe_data.manifest import validate
from graspe_data.simulation.lidar.settings import LidarSettings


@pytest.mark.parametrize("rate", [10.0, 5.0, 10 / 3, 2.5, 1.0])
def test_every_turn_or_every_second_and_so_on_may_be_published(rate: float) -> None:
    assert LidarSettings(rate=rate).rate == rate


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ({"rate": 4.0}, "4 Hz is no whole fraction of the rotation rate of 10 Hz"),
        ({"rate": 20.0}, "20 Hz is no whole fraction of the rotation rate of 10 Hz"),
        ({"minimum_range": 5.0, "maximum_range": 2.0}, "5 m is not below the maximum_range of 2 m"),
        ({"sub_ray": 3}, "sub_ray: unknown key. Did you mean 'sub_rays'?"),
        ({"sub_rays": 100}, "sub_rays: Input should be less than or equal to 9"),
        ({"returns": "first"}, "returns: Input should be 'strongest', 'last' or 'dual'"),
    ],
)
def test_what_does_not_fit_is_refused(content: dict[str, object], text: str) -> None:
    with pytest.raises(ManifestError) as caught:
        validate(content, LidarSettings, "scenario.yaml")
    assert text in str(caught.value)
