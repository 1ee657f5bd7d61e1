import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.simulation.world.capsules import capsule_gaps
from graspe_data.simulation.world.plan import Spots

Number = st.floats(-5, 5).map(lambda value: round(value, 3))
Place = st.tuples(Number, Number)


def _capsule(start: tuple[float, float], end: tuple[float, float], radius: float) -> Spots:
    return Spots(np.array([start]), np.array([end]), np.array([radius]))


@settings(max_examples=150, deadline=None)
@given(Place, Place, Place, Place)
def test_gap_is_the_least_of_many_sampled_distances(
    a: tuple[float, float],
    b: tuple[float, float],
    c: tuple[float, float],
    d: tuple[float, float],
) -> None:
    share = np.linspace(0, 1, 201)[:, None]
    first = np.array(a) * (1 - share) + np.array(b) * share
    second = np.array(c) * (1 - share) + np.array(d) * share
    sampled = np.linalg.norm(first[:, None] - second[None], axis=-1).min()
    found = capsule_gaps(_capsule(a, b, 0.0), _capsule(c, d, 0.0))[0, 0]
    assert found <= sampled + 1e-9
    assert found >= sampled - 0.11


def test_closed_forms() -> None:
    wall = _capsule((0, 0), (4, 0), 0.1)
    assert capsule_gaps(wall, _capsule((2, 3), (2, 3), 0.5))[0, 0] == pytest.approx(2.4)
    assert capsule_gaps(wall, _capsule((7, 4), (7, 4), 0.0))[0, 0] == pytest.approx(4.9)
    assert capsule_gaps(wall, _capsule((2, -1), (2, 1), 0.2))[0, 0] == pytest.approx(-0.3)
