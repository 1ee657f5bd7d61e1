"""The settings of the methods that drive by a map."""

from __future__ import annotations

from pipelines.trials.config import TrialConfig
from pipelines.trials.map_methods import (
    FIELD_LAYERS,
    FIELD_PEAKS,
    FIELD_PLANNING,
    MapSettings,
    map_settings,
)
from planners.intensity_source import IntensityMapSettings


def test_what_a_config_leaves_out_stays_as_the_field_has_it() -> None:
    given = {
        "intensity": {"planning": {"classes": {"threshold": 0.5}}},
        "glass_slam": {"peaks": {"least": 50}},
    }
    settings = TrialConfig.model_validate({"maps": given}).maps
    classes = FIELD_PLANNING.classes.model_copy(update={"threshold": 0.5})
    assert settings.intensity.layers == FIELD_LAYERS
    assert settings.intensity.planning == FIELD_PLANNING.model_copy(update={"classes": classes})
    assert settings.glass_slam.peaks == FIELD_PEAKS.model_copy(update={"least": 50.0})


def test_without_a_config_they_are_the_fields() -> None:
    settings = MapSettings()
    assert settings.intensity.planning == FIELD_PLANNING
    assert settings == MapSettings.model_validate(settings.model_dump())


def test_the_printed_map_has_nothing_of_the_fields() -> None:
    """Equation (1) sums intensities, (3) sums layers, and glass is what (4) to (7) find."""
    _, printed, _ = map_settings("mim_printed", MapSettings())
    assert isinstance(printed, IntensityMapSettings)
    assert printed.layers.cell == "sum"
    assert printed.planning.classes.reading == "sum"
    assert printed.planning.classes.rim is None
    assert printed.planning.glass is not None
    assert (printed.planning.glass.margin, printed.planning.glass.extend) == (0, 0)
    given = TrialConfig.model_validate({"maps": {"intensity": {"solid": 0.3}}}).maps
    assert map_settings("mim_printed", given)[1] == printed
    assert map_settings("mim", given)[1] != map_settings("mim", MapSettings())[1]
