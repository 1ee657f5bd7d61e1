"""The settings of the methods that drive by a map."""

from __future__ import annotations

from pipelines.trials.config import TrialConfig
from pipelines.trials.map_methods import FIELD_LAYERS, FIELD_PEAKS, FIELD_PLANNING, MapSettings


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
