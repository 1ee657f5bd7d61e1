"""Conditions of the sensors under which trials are driven."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from graspe_data.manifest import Settings, find_manifest, load_manifest, validate
from graspe_data.simulation.occlusions import Occlusion
from graspe_data.simulation.scenario import Scenario


class SensorCondition(Settings):
    """A file of ``manifests/conditions``: what ails the sensors of every trial, and when."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,60}$")]
    about: Annotated[str, Field(max_length=1000)] = ""
    occlusions: Annotated[tuple[Occlusion, ...], Field(min_length=1, max_length=16)]
    """As a scenario's; ``every_s`` counts from the start of the trial."""


def load_condition(name: str | Path) -> SensorCondition:
    """A condition by path, or by the name of one that ships.

    Raises:
        ManifestError: There is none, or it does not validate.
    """
    return load_manifest(find_manifest("conditions", name), SensorCondition)


def under(scenario: Scenario, condition: SensorCondition) -> Scenario:
    """The same scenario, its worlds, noise and own covers too, with ailing sensors.

    Where both cover a sensor at once, it is the scenario's cover that counts.

    Raises:
        ManifestError: Together they are more than a scenario may have.
    """
    both = (*scenario.occlusions, *condition.occlusions)
    changes = scenario.model_dump() | {"occlusions": [each.model_dump() for each in both]}
    return validate(changes, Scenario, f"{scenario.name} under {condition.name}")
