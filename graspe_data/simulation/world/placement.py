"""Where the features of a world stand."""

from __future__ import annotations

import numpy as np

from graspe_data.errors import ManifestError
from graspe_data.simulation.world.feature import Feature, LineFeature, Region, RoundFeature
from graspe_data.simulation.world.kinds.tall_grass import TallGrass
from graspe_data.simulation.world.plan import NOWHERE, Spots
from graspe_data.simulation.world.scattering import check_number, join_spots, radii, scatter
from graspe_data.simulation.world.settings import WorldSettings
from graspe_data.simulation.world.streams import stream
from graspe_data.simulation.world.surroundings import SOLID, Surroundings

STRIPE = 1.0
"""Width in metres of the stripes that cover a region filled with grass."""


def place_features(settings: WorldSettings, name: str, seed: int) -> dict[int, Spots]:
    """Spots of every feature that stands on the ground, by its index.

    What is placed comes first, then what is scattered, each in the order of the settings. Each
    feature draws from a generator of its own, so that a change of one moves others only where
    they would collide; ``name`` is the scenario's.

    Raises:
        ManifestError: Something placed hinders the start, or what is scattered does not fit.
    """
    features = [(k, f) for k, f in enumerate(settings.features) if isinstance(f, Feature)]
    spots: dict[int, Spots] = {}
    solid = NOWHERE
    for index, feature in sorted(features, key=lambda item: item[1].per_100_m2 is not None):
        where = f"features.{index}.{feature.kind}"
        around = Surroundings(settings, solid, feature, where)
        spots[index] = _spots(around, stream(name, seed, "places", index))
        if around.effect in SOLID:
            solid = join_spots(solid, spots[index])
        check_number(where, sum(map(len, spots.values())))
    return spots


def _spots(around: Surroundings, generator: np.random.Generator) -> Spots:
    feature = around.feature
    region = feature.within or around.settings.arena
    if feature.per_100_m2 is not None:
        return scatter(around, region, generator)
    filling = isinstance(feature, TallGrass) and feature.fills
    spots = _stripes(region) if filling else _placed(feature, generator)
    if around.hinders_start(spots).any():
        raise _too_near(around, spots)
    return spots


def _placed(feature: Feature, generator: np.random.Generator) -> Spots:
    if isinstance(feature, LineFeature):
        ends = np.array(feature.lines, np.float64)
        return Spots(ends[:, 0], ends[:, 1], radii(feature, len(ends), generator))
    places = np.array(feature.at if isinstance(feature, RoundFeature) else (), np.float64)
    return Spots(places, places, radii(feature, len(places), generator))


def _stripes(region: Region) -> Spots:
    """Parallel stripes, as long as the region, that cover it side by side."""
    low, high = np.array(region[:2]), np.array(region[2:])
    across = int(np.argmin(high - low))
    count = max(int(np.ceil((high - low)[across] / STRIPE)), 1)
    radius = (high - low)[across] / count / 2
    start, end = np.tile(low + radius, (count, 1)), np.tile(high - radius, (count, 1))
    start[:, across] = end[:, across] = low[across] + radius * (2 * np.arange(count) + 1)
    return Spots(start, end, np.full(count, radius))


def _too_near(around: Surroundings, spots: Spots) -> ManifestError:
    gaps = around.gaps_to_start(spots)
    nearest = int(gaps.argmin())
    field = "lines" if isinstance(around.feature, LineFeature) else "at"
    start, place = around.settings.start, spots.start[nearest]
    born = "inside" if gaps[nearest] <= 0 else f"{gaps[nearest]:.2f} m from"
    return ManifestError(
        f"{around.where}.{field}.{nearest}: the robot would be born {born} the "
        f"{around.feature.kind.replace('_', ' ')} at ({place[0]:g}, {place[1]:g}): start is "
        f"({start[0]:g}, {start[1]:g}), expected at least {around.settings.start_clearance:g} m "
        "between them: move one of them, or lower start_clearance."
    )
