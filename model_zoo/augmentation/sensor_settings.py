"""How the reliabilities of a dataset were computed, for degraded rows of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import validate
from graspe_data.shards.dataset_manifest import DatasetIndex
from model_zoo.augmentation.settings import AugmentationSettings


def sensor_settings(
    index: DatasetIndex, settings: AugmentationSettings | None = None
) -> AugmentationSettings:
    """Settings of degradations, with the reliabilities and the scan as a dataset computed them.

    Args:
        index: Of the dataset; what its configuration does not say stays as in ``settings``.
        settings: All else; None takes the defaults.

    Raises:
        ZooError: The configuration has numbers that do not fit.
    """
    built = _mapping(index.configuration.get("dataset"))
    found = {key: built.get(key) for key in ("image_reliability", "point_reliability")}
    found["laser_scan"] = _mapping(built.get("points")).get("laser_scan")
    known = {key: value for key, value in found.items() if value is not None}
    given = {} if settings is None else settings.model_dump()
    try:
        return validate(given | known, AugmentationSettings, f"configuration of {index.name}")
    except ManifestError as error:
        raise ZooError(str(error)) from error


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}
