"""How high the base frame is above the ground, as far as a recording tells it."""

from __future__ import annotations

from typing import Final

import numpy as np

from graspe_data.errors import GeometryError
from graspe_data.geometry import Transform
from graspe_data.inspection.evidence import Evidence
from graspe_data.inspection.topic_content import CloudContent

_ON_THE_GROUND_M: Final = 0.1
_UNKNOWN: Final = (0.0, "missing: metres from the ground to the base frame")


def base_height(evidence: Evidence, base: str) -> tuple[float, str]:
    """Height of the base above the ground in metres: by base_footprint, or by the lowest points.

    Returns:
        The height, and the note for the manifest: where it was found, or that it is missing.
    """
    footprint = fixed_transform(evidence, base, "base_footprint")
    if footprint is not None:
        height = round(float(-footprint.translation[2]), 3)
        return height + 0.0, "from tf: base_footprint is on the ground"
    points = evidence.survey.topics.get(evidence.choice.topics.get("points", ""))
    content = None if points is None else points.content
    if points is None or not isinstance(content, CloudContent) or content.ground_z is None:
        return _UNKNOWN
    placed = fixed_transform(evidence, base, points.frame)
    if placed is None:
        return _UNKNOWN
    ground = float(placed.apply(np.array([0.0, 0.0, content.ground_z]))[2])
    height = 0.0 if abs(ground) < _ON_THE_GROUND_M else round(-ground, 2)
    where = f"{abs(ground):.2f} m {'above' if ground > 0 else 'below'} {base}"
    return height, f"guess: {points.info.name} sees most low points {where}; measure it"


def fixed_transform(evidence: Evidence, base: str, frame: str) -> Transform | None:
    """The last fixed transform from a frame to the base by tf; None where there is none."""
    try:
        return evidence.transforms.changes(base, frame)[-1][1]
    except GeometryError:
        return None
