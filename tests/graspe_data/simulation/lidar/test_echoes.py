"""Echoes of rays from rough surfaces and glass, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.simulation.lidar.echoes import FAR, Echoes, Surfaces
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.materials import MATERIALS, MaterialName
from graspe_data.simulation.world.mesh import Mesh, join_meshes, mesh_of

GLASS = MATERIALS["glass"]
CONCRETE = MATERIALS["concrete"]


def sheet(x: float, material: MaterialName, lean: float = 0.0, half: float = 50.0) -> Mesh:
    """A sheet across the x axis at ``x``, leaning by an angle about y."""
    up = np.array([np.sin(lean), 0.0, np.cos(lean)])
    left = np.array([0.0, 1.0, 0.0])
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = half * (signs[:, :1] * left + signs[:, 1:] * up) + (x, 0.0, 0.0)
    return mesh_of(corners, np.array([[0, 1, 2], [0, 2, 3]]), material)


def echoes(*sheets: Mesh) -> Echoes:
    """What one ray along the x axis brings back."""
    surfaces = Surfaces(RayScene(join_meshes(sheets), threads=1), tuple(MATERIALS.values()))
    along = np.array([[1.0, 0.0, 0.0]], np.float32)
    return surfaces.echoes(np.zeros((1, 3), np.float32), along)


@settings(max_examples=30, deadline=None)
@given(st.floats(1.0, 80.0), st.floats(-1.4, 1.4), st.sampled_from(["bark", "soil", "bead"]))
def test_rough_surfaces_return_reflectivity_times_the_cosine_of_incidence(
    x: float, lean: float, material: MaterialName
) -> None:
    seen = echoes(sheet(x, material, lean))
    np.testing.assert_allclose(seen.distance, x, rtol=1e-5)
    expected = MATERIALS[material].reflectivity * np.cos(lean)
    np.testing.assert_allclose(seen.energy, expected, rtol=1e-4, atol=1e-6)
    assert not len(seen.glint_ray)


def test_the_sky_returns_nothing() -> None:
    seen = echoes(sheet(-3.0, "concrete"))
    assert seen.distance.tolist() == [FAR]
    assert seen.energy.tolist() == [0.0]


@pytest.mark.parametrize("panes", [1, 2, 3])
def test_each_pane_takes_its_share_twice_from_the_wall_behind(panes: int) -> None:
    sheets = [sheet(2.0 + pane, "glass", 0.6) for pane in range(panes)]
    seen = echoes(*sheets, sheet(9.0, "concrete"))
    np.testing.assert_allclose(seen.distance, 9.0, rtol=1e-5)
    expected = CONCRETE.reflectivity * GLASS.transmission ** (2 * panes)
    np.testing.assert_allclose(seen.energy, expected, rtol=1e-5)


def test_more_than_three_panes_hide_the_wall() -> None:
    sheets = [sheet(2.0 + pane, "glass", 0.6) for pane in range(4)]
    assert echoes(*sheets, sheet(9.0, "concrete")).energy.tolist() == [0.0]


@pytest.mark.parametrize("degrees", [0.0, 2.0, 4.0, 8.0])
def test_a_pane_glints_near_normal_incidence(degrees: float) -> None:
    seen = echoes(sheet(2.0, "glass", np.radians(degrees)), sheet(9.0, "concrete"))
    np.testing.assert_allclose(seen.glint_distance, 2.0, rtol=1e-5)
    expected = GLASS.reflectivity * np.exp(-((degrees / 4.0) ** 2))
    np.testing.assert_allclose(seen.glint_energy, expected, rtol=1e-2)


def test_a_slanted_pane_does_not_glint() -> None:
    assert not len(echoes(sheet(2.0, "glass", np.radians(20.0))).glint_ray)


def test_a_second_pane_glints_through_the_first() -> None:
    seen = echoes(sheet(2.0, "glass"), sheet(4.0, "glass"))
    assert seen.glint_ray.tolist() == [0, 0]
    np.testing.assert_allclose(seen.glint_distance, [2.0, 4.0], rtol=1e-5)
    shares = np.array([1.0, GLASS.transmission**2])
    np.testing.assert_allclose(seen.glint_energy, GLASS.reflectivity * shares, rtol=1e-5)
    assert seen.energy.tolist() == [0.0]
