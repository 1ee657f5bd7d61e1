"""Scattering the things of a feature over a region."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.errors import ManifestError
from graspe_data.simulation.world.capsules import capsule_gaps
from graspe_data.simulation.world.feature import (
    Feature,
    LineFeature,
    Region,
    RoundFeature,
    draw,
)
from graspe_data.simulation.world.plan import NOWHERE, Spots
from graspe_data.simulation.world.surroundings import Surroundings

MOST_THINGS = 5000
TRIES = 64
FIRST_TRIES = 4
"""Looked at alone, since one of them mostly fits."""


def scatter(around: Surroundings, region: Region, generator: np.random.Generator) -> Spots:
    """Draw how many things there are, and a free spot for each.

    Each thing draws candidates of its own, so that where one had to give way the others stay.

    Raises:
        ManifestError: There are too many, or one finds no free spot.
    """
    area = (region[2] - region[0]) * (region[3] - region[1]) / 100
    low, high = around.feature.per_100_m2 or (0.0, 0.0)
    count = int(generator.uniform(low, high) * area + generator.random())
    check_number(around.where, count)
    chosen: list[Spots] = []
    for candidates in _candidates(around.feature, region, count, generator):
        spot = _first_free(around, candidates, region)
        if not len(spot):
            raise _does_not_fit(around.where, len(chosen), count)
        chosen.append(spot)
        if around.keeps_clear:
            around = replace(around, solid=join_spots(around.solid, spot))
    return join_spots(NOWHERE, *chosen)


def radii(feature: Feature, count: int, generator: np.random.Generator) -> Floats:
    """Radii (count,) of a feature's spots in metres."""
    if isinstance(feature, RoundFeature):
        return draw(feature.radius, count, generator)
    thickness = feature.half_thickness if isinstance(feature, LineFeature) else 0.0
    return np.full(count, thickness)


def join_spots(*parts: Spots) -> Spots:
    """All spots in one, in the order given."""
    return Spots(
        np.concatenate([part.start for part in parts]),
        np.concatenate([part.end for part in parts]),
        np.concatenate([part.radius for part in parts]),
    )


def check_number(where: str, count: int) -> None:
    """Refuse more things than a world may have.

    Raises:
        ManifestError: There are more.
    """
    if count > MOST_THINGS:
        raise ManifestError(
            f"{where}.per_100_m2: {count} things in this world, expected at most {MOST_THINGS}: "
            "lower per_100_m2 here or in the features before."
        )


def _candidates(
    feature: Feature, region: Region, count: int, generator: np.random.Generator
) -> list[Spots]:
    sizes = np.repeat(radii(feature, count, generator)[:, None], TRIES, axis=1)
    start = generator.uniform(region[:2], region[2:], (count, TRIES, 2))
    end = start.copy()
    if isinstance(feature, LineFeature):
        length = draw(feature.length, count, generator)[:, None]
        heading = generator.uniform(0, 2 * np.pi, (count, TRIES))
        end += np.stack([length * np.cos(heading), length * np.sin(heading)], axis=-1)
    return [Spots(*each) for each in zip(start, end, sizes, strict=True)]


def _first_free(around: Surroundings, candidates: Spots, region: Region) -> Spots:
    """The first candidate that is free, or none."""
    for tries in (slice(FIRST_TRIES), slice(FIRST_TRIES, None)):
        spots = _at(candidates, tries)
        free = np.all((spots.end >= region[:2]) & (spots.end <= region[2:]), axis=1)
        free &= ~around.hinders_start(spots)
        if around.keeps_clear:
            gaps = capsule_gaps(spots, around.solid)
            free &= (gaps >= around.settings.clearance).all(axis=1)
        if free.any():
            first = int(free.argmax())
            return _at(spots, slice(first, first + 1))
    return NOWHERE


def _at(spots: Spots, which: slice) -> Spots:
    return Spots(spots.start[which], spots.end[which], spots.radius[which])


def _does_not_fit(where: str, done: int, wanted: int) -> ManifestError:
    return ManifestError(
        f"{where}.per_100_m2: found no free place for number {done + 1} of {wanted} in {TRIES} "
        "tries: lower per_100_m2 or clearance, enlarge within, or set intertwined: true."
    )
