"""Sun and sky share the illuminance that was drawn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from graspe_data.simulation.camera.light import LightSettings, Sky, draw_light

SKIES = st.sampled_from(["clear", "overcast", "indoor"])


@given(SKIES, st.floats(0.3, 1e5), st.floats(0.02, 1.57), st.integers(0, 99))
def test_level_ground_receives_what_was_drawn(
    sky: Sky, lux: float, elevation: float, seed: int
) -> None:
    settings = LightSettings(
        illuminance_lux=(lux, lux), sun_elevation=(elevation, elevation), sky=sky
    )
    light = draw_light(settings, np.random.default_rng(seed))
    assert light.level_lux == pytest.approx(lux)
    assert np.linalg.norm(light.sun_direction) == pytest.approx(1.0)
    assert np.arcsin(light.sun_direction[2]) == pytest.approx(elevation)


@given(st.integers(0, 999))
def test_what_is_drawn_lies_within_the_ranges(seed: int) -> None:
    settings = LightSettings(illuminance_lux=(5.0, 50.0), sky="overcast")
    light = draw_light(settings, np.random.default_rng(seed))
    assert 5.0 <= light.level_lux <= 50.0
    assert light.sun_lux == 0.0


def test_a_high_sun_gives_most_of_a_clear_days_light_and_a_low_one_less() -> None:
    shares = []
    for elevation in (0.05, 0.3, 1.2):
        settings = LightSettings(sun_elevation=(elevation, elevation))
        light = draw_light(settings, np.random.default_rng(0))
        shares.append(1.0 - light.sky_lux / light.level_lux)
    assert shares == sorted(shares)
    assert shares[0] < 0.3
    assert 0.8 < shares[-1] < 0.9


def test_the_same_seed_gives_the_same_light() -> None:
    first, second = (draw_light(LightSettings(), np.random.default_rng(7)) for _ in range(2))
    assert first.sun_direction.tobytes() == second.sun_direction.tobytes()
    assert (first.sun_lux, first.sky_lux) == (second.sun_lux, second.sky_lux)


@pytest.mark.parametrize("name", ["illuminance_lux", "sun_elevation", "sun_azimuth"])
def test_a_range_whose_ends_are_swapped_is_refused(name: str) -> None:
    with pytest.raises(ValidationError, match=f"{name}: the low end 1 is above the high end 0.5"):
        LightSettings.model_validate({name: (1.0, 0.5)})
