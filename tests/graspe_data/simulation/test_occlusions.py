"""What covers the sensors: when, how long, how much, all within what was asked."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from graspe_data.sensor_failures import Droplets, Dust, Glare, NearLeaves
from graspe_data.simulation.camera.lens_cover import LensCover
from graspe_data.simulation.lidar.occlusion import SectorOcclusion, ThinnedReturns
from graspe_data.simulation.occlusions import (
    CoveredLens,
    CoveredSector,
    Covers,
    Occlusion,
    draw_covers,
)

LENS = CoveredLens(kind="lens", share=(0.2, 0.9), every_s=(5.0, 20.0), lasting_s=(1.0, 4.0))
SECTOR = CoveredSector(kind="lidar", width=(0.3, 1.2), every_s=(0.0, 9.0), lasting_s=(2.0, 2.0))


def drawn(*occlusions: Occlusion, duration_s: float = 600.0, seed: int = 0) -> Covers:
    return draw_covers(occlusions, duration_s, np.random.default_rng(seed))


@settings(max_examples=50)
@given(st.integers(0, 2**32), st.floats(1.0, 1000.0))
def test_covers_come_in_time_and_last_and_pause_as_asked(seed: int, duration_s: float) -> None:
    covers = drawn(LENS, duration_s=duration_s, seed=seed).lens
    starts = np.array([0.0, *(start for start, _, _ in covers)])
    stops = np.array([0.0, *(stop for _, stop, _ in covers)])
    pauses, lasting = starts[1:] - stops[:-1], (stops - starts)[1:]
    assert ((pauses >= 5.0 - 1e-9) & (pauses <= 20.0 + 1e-9)).all()
    assert ((lasting >= 1.0 - 1e-9) & (lasting <= 4.0 + 1e-9)).all()
    assert (starts <= duration_s).all()
    assert duration_s - stops[-1] <= 20.0


def test_shares_and_widths_lie_in_their_ranges_and_vary() -> None:
    covers = drawn(LENS, SECTOR)
    shares = np.array([c.share for _, _, c in covers.lens if isinstance(c, LensCover)])
    sectors = [cover for _, _, cover in covers.lidar if isinstance(cover, SectorOcclusion)]
    widths = np.array([sector.stop - sector.start for sector in sectors])
    assert len(sectors) == len(covers.lidar)
    assert 0.2 <= shares.min() < 0.3
    assert 0.8 < shares.max() <= 0.9
    assert 0.3 <= widths.min() < 0.5
    assert 1.0 < widths.max() <= 1.2 + 1e-9
    assert len({cover.seed for _, _, cover in covers.lens}) == len(shares)


def test_a_sensor_is_covered_while_its_cover_lasts_and_no_longer() -> None:
    covers = drawn(LENS)
    start, stop, cover = covers.lens[0]
    assert covers.on_lens(start) is covers.on_lens(stop - 1e-6) is cover
    assert covers.on_lens(start - 1e-6) is covers.on_lens(stop) is None
    assert covers.on_lidar(start) is None


def test_without_occlusions_nothing_is_covered() -> None:
    assert drawn() == Covers()


def test_the_same_seed_draws_the_same() -> None:
    assert drawn(LENS, SECTOR, seed=3) == drawn(LENS, SECTOR, seed=3) != drawn(LENS, SECTOR, seed=4)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"share": (0.9, 0.2)}, "share: the low end 0.9 is above the high end 0.2"),
        ({"lasting_s": (3.0, 1.0)}, "lasting_s"),
        ({"share": (0.5, 1.5)}, "less than or equal to 1"),
        ({"lasting_s": (0.0, 0.0)}, "greater than or equal to 0.1"),
        ({"kind": "sonar"}, "sonar"),
    ],
)
def test_impossible_covers_are_refused(wrong: dict[str, object], said: str) -> None:
    adapter: TypeAdapter[Occlusion] = TypeAdapter(Occlusion)
    with pytest.raises(ValidationError, match=said):
        adapter.validate_python(LENS.model_dump() | wrong)


@pytest.mark.parametrize(
    ("kind", "strength", "made"),
    [
        ("glare", "strength", Glare),
        ("droplets", "share", Droplets),
        ("dust", "strength", Dust),
        ("near_leaves", "share", NearLeaves),
        ("thinned", "share", ThinnedReturns),
    ],
)
def test_what_misleads_is_drawn_at_its_strength(kind: str, strength: str, made: type) -> None:
    asked = {"kind": kind, strength: (0.3, 0.5), "every_s": (1.0, 3.0), "lasting_s": (2.0, 2.0)}
    covers = drawn(TypeAdapter[Occlusion](Occlusion).validate_python(asked))
    found = [cover for _, _, cover in (*covers.lens, *covers.lidar)]
    assert len(found) > 100
    assert {type(cover) for cover in found} == {made}
    drawn_at = np.array([getattr(cover, strength) for cover in found])
    assert 0.3 <= drawn_at.min() < 0.32
    assert 0.48 < drawn_at.max() <= 0.5


def test_a_camera_freezes_and_goes_on() -> None:
    asked = {"kind": "frozen", "every_s": (4.0, 4.0), "lasting_s": (2.0, 2.0)}
    covers = drawn(TypeAdapter[Occlusion](Occlusion).validate_python(asked))
    assert covers.frozen_since(3.9) is None
    assert covers.frozen_since(4.0) == covers.frozen_since(5.9) == 4.0
    assert covers.frozen_since(6.0) is None
    assert covers.on_lens(5.0) is None
