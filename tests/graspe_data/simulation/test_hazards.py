"""Who can tell what: hazards before the camera and the lidar, and what they do to a robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.arrays import Floats, Mask
from graspe_data.geometry import Transform
from graspe_data.manifest import validate
from graspe_data.robot import Robot
from graspe_data.simulation.camera.camera import Camera, _pixel_rays
from graspe_data.simulation.camera.light import Light, LightSettings, draw_light
from graspe_data.simulation.camera.settings import CameraSettings
from graspe_data.simulation.lidar.lidar import Lidar
from graspe_data.simulation.lidar.settings import LidarSettings
from graspe_data.simulation.motion.drive import Drive
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.truth.events import true_events
from graspe_data.simulation.world.build_world import build_world
from graspe_data.simulation.world.materials import MATERIAL_NAMES
from graspe_data.simulation.world.settings import WorldSettings
from graspe_data.simulation.world.world import World

DriveOf = Callable[..., Drive]

BASE = 0.5
EYE = BASE + LidarSettings().mounting.translation[2]
LENS = BASE + CameraSettings().mounting.translation[2]
BLIND_M = (EYE - 0.15) / math.tan(math.radians(15.0))
"""Metres from the lidar within which nothing of 0.15 m is met by its lowest beam."""
STANDING = Transform(np.eye(3), np.array([0.0, 0.0, BASE]))
STILL = np.zeros(3), np.zeros(3)
EXACT = LidarSettings(range_noise=0, intensity_noise=0, dropout=0)
FLAT_KINDS = ("mud", "water", "litter", "paint")


def world_with(*features: dict[str, Any], **more: Any) -> World:
    given = {
        "length": 30,
        "width": 20,
        "ground": {"cover": "soil", "amplitude": 0.0, "cell": 0.25},
        "features": list(features),
        "start_clearance": 0.0,
        **more,
    }
    return build_world(validate(given, WorldSettings, "here"), "tried", 3)


def cloud(world: World) -> NDArray[np.void]:
    lidar = Lidar(world, RayScene(world.surfaces), EXACT)
    return lidar.turn(0.0, lambda _: STANDING, np.random.default_rng(0))


def ranges(points: NDArray[np.void]) -> Floats:
    return np.sqrt(sum(points[axis].astype(float) ** 2 for axis in "xyz"))


def pixels(world: World) -> NDArray[np.str_]:
    """The material that each pixel of a standing robot's camera sees, (H, W)."""
    scene, settings = RayScene(world.surfaces), CameraSettings()
    camera = Camera(world, scene, draw_light(LightSettings(), np.random.default_rng(0)), settings)
    pose = STANDING @ camera.base_from_camera
    rays = (_pixel_rays(camera.intrinsics) @ pose.rotation.T).astype(np.float32)
    hits = scene.cast(pose.translation, rays)
    names = np.array([*MATERIAL_NAMES, *[""] * (256 - len(MATERIAL_NAMES))])
    return names[hits.material].reshape(settings.height, settings.width)


def picture(world: World, light: Light | None = None, seed: int = 0) -> NDArray[np.uint8]:
    noon = LightSettings(illuminance_lux=(5e4, 5e4), sun_elevation=(0.9, 0.9))
    sun = light or draw_light(noon, np.random.default_rng(0))
    camera = Camera(world, RayScene(world.surfaces), sun, CameraSettings(vibration=0))
    return camera.picture(STANDING, STILL, np.random.default_rng(seed))


def above_ground(points: NDArray[np.void], at: tuple[float, float], radius: float) -> Mask:
    """Which returns come from more than 1 cm above flat ground, within a radius of a place."""
    x, y, z = (points[axis].astype(float) for axis in "xyz")
    near = np.hypot(x + 0.2 - at[0], y - at[1]) < radius + 0.02
    return np.asarray(near & (z > 0.01 - EYE), np.bool_)


@pytest.mark.parametrize("kind", ["stump", "rock"])
def test_a_low_thing_in_the_blind_zone_is_seen_by_the_camera_alone(kind: str) -> None:
    place = (1.8, 0.1)
    low = {"kind": kind, "at": [list(place)], "radius": [0.2, 0.2], "height": [0.13, 0.13]}
    world = world_with(low)
    assert math.dist(place, (0.2, 0.0)) + 0.2 < BLIND_M == pytest.approx(2.61, abs=0.01)
    assert not above_ground(cloud(world), place, 0.2).any()
    shown = np.isin(pixels(world), ["bark", "wood"] if kind == "stump" else ["rock"])
    depth = place[0] - 0.2 - 0.45  # From the lens to the near side.
    columns = np.flatnonzero(shown.any(axis=0))
    focal = 160 / math.tan(1.17 / 2)
    slant = math.cos(math.atan2(LENS - 0.1, depth) - 0.45) * math.hypot(LENS - 0.1, depth + 0.2)
    assert np.ptp(columns) + 1 == pytest.approx(focal * 0.4 / slant, rel=0.12)
    assert shown.sum() > 1000


def test_a_stump_farther_off_returns_only_where_a_beam_meets_it() -> None:
    def returned(x: float) -> bool:
        stump = {"kind": "stump", "at": [[x, 0.0]], "radius": [0.2, 0.2], "height": [0.15, 0.15]}
        return bool(above_ground(cloud(world_with(stump)), (x, 0.0), 0.2).any())

    def met(x: float) -> bool:
        """Whether a ring of -15, -13, ... degrees passes between its foot and its top."""
        near, far = x - 0.2 - 0.2, x - 0.2 + 0.2
        slopes = np.tan(np.radians(np.arange(1.0, 16.0, 2.0)))
        side = (near * slopes < EYE - 0.01) & (near * slopes > EYE - 0.15)
        top = ((EYE - 0.15) / slopes > near) & ((EYE - 0.15) / slopes < far)
        return bool((side | top).any())

    places = np.arange(1.5, 6.0, 0.25)
    answers = [(returned(x), met(x)) for x in places.tolist()]
    # A beam's rays lie a little beside its axis, so that an edge may be met or not.
    assert sum(one == other for one, other in answers) >= len(places) - 2
    assert not any(one for one, _ in answers[:5])
    assert sum(one for one, _ in answers) > 5


@pytest.mark.parametrize("kind", FLAT_KINDS)
@pytest.mark.parametrize("amplitude", [0.0, 0.1])
def test_a_lidar_cannot_tell_what_lies_flat_from_bare_ground(kind: str, amplitude: float) -> None:
    ground = {"cover": "soil", "amplitude": amplitude, "cell": 0.25}
    patch = {"kind": kind, "at": [[4.0, 0.0], [2.0, 3.0]], "radius": [1.2, 1.2]}
    world = world_with(patch, ground=ground)
    bare, covered = cloud(world_with(ground=ground)), cloud(world)
    assert len(bare) == len(covered)
    away = np.abs(ranges(bare) - ranges(covered))
    brighter = np.abs(bare["intensity"] - covered["intensity"])
    if kind == "litter":
        # Single leaves stand some cm up, as high as the noise of level ground at some metres.
        x, y, z = (covered[axis].astype(float) for axis in "xyz")
        height = z + EYE - world.ground.height(x + 0.2, y)
        assert height[np.hypot(x, y) < 6].max() < 0.08
    else:
        assert away.max() < 0.03 if amplitude == 0 else np.quantile(away, 0.999) < 0.03
        assert np.quantile(brighter, 0.999) <= 2


@pytest.mark.parametrize("kind", FLAT_KINDS)
def test_a_camera_can_tell_what_lies_flat(kind: str) -> None:
    patch = {"kind": kind, "at": [[2.2, 0.0]], "radius": [0.6, 0.6]}
    world = world_with(patch)
    covered, bare = picture(world).astype(float), picture(world_with()).astype(float)
    inside = pixels(world) == kind
    changed = np.abs(covered - bare).mean(axis=2)
    assert inside.sum() > 2000
    assert changed[inside].mean() > 15
    assert changed[inside].mean() > 2 * changed[~inside].mean()


def test_a_patch_lies_on_the_triangles_of_uneven_ground() -> None:
    ground = {"cover": "soil", "amplitude": 0.15, "wavelength": 4, "cell": 0.25}
    world = world_with({"kind": "mud", "at": [[3, 1]], "radius": [1.5, 1.5]}, ground=ground)
    bare = world_with(ground=ground)
    places = np.random.default_rng(1).uniform(-0.7, 0.7, (4000, 2)) + np.array([3.0, 1.0])
    origins = np.column_stack([places, np.full(4000, 2.0)])
    down = np.tile([0.0, 0.0, -1.0], (4000, 1))
    hits, under = (RayScene(one.surfaces).cast(origins, down) for one in (world, bare))
    lifted = under.distance - hits.distance
    assert np.mean(hits.material == MATERIAL_NAMES.index("mud")) > 0.98
    assert lifted.min() > -1e-4
    assert lifted.max() < 0.006


def test_water_mirrors_the_sky_and_mud_a_quarter_of_that() -> None:
    overcast = Light("overcast", np.array([0.0, 0.0, 1.0]), 0.0, 1e4)

    def mirrored(kind: str) -> float:
        patch = {"kind": kind, "at": [[3.0, 0.0]], "radius": [2.5, 2.5]}
        black = {"colour": [0, 0, 0], "contrast": 0}
        world = world_with(patch, materials={kind: black, "soil": black})
        shown = picture(world, overcast)[pixels(world) == kind]
        return float(np.mean((shown / 255.0) ** 2.2))

    assert mirrored("water") > 2 * mirrored("mud") > 0


@pytest.mark.parametrize("kind", ["mud", "water"])
def test_a_robot_sinks_in_by_the_closed_form_and_is_stuck(kind: str, scripted: DriveOf) -> None:
    patch = {"kind": kind, "at": [[2.5, 0.0]], "radius": [1.0, 1.0], "give": [0.25, 0.25]}
    drive = scripted(world_with(patch), [Leg(8.0, 0.5, 0.0)])
    front = drive.position[:, 0] + 0.55
    depth = np.maximum(front - 1.5, 0.0)
    expected = 0.5 * np.exp(-depth / 0.25)
    settled = slice(100, None)
    np.testing.assert_allclose(drive.velocity[settled, 0], expected[settled], atol=0.02)
    assert [event.kind for event in true_events(drive)] == ["stuck"]


@pytest.mark.parametrize("kind", ["litter", "paint"])
def test_what_only_looks_like_something_does_nothing(kind: str, scripted: DriveOf) -> None:
    patch = {"kind": kind, "at": [[2.0, 0.0]], "radius": [1.0, 1.0]}
    one, other = (scripted(world_with(*have), [Leg(6.0, 0.5, 0.1)]) for have in ((), (patch,)))
    assert one.position.tobytes() == other.position.tobytes()
    assert true_events(other) == []


def test_a_robot_stumbles_over_a_stump(scripted: DriveOf) -> None:
    stumps = {"kind": "stump", "at": [[2.0, 0.0], [5.0, 0.1]], "height": [0.15, 0.15]}
    drive = scripted(world_with(stumps), [Leg(12.0, 0.55, 0.0)])
    assert {event.kind for event in true_events(drive)} == {"stumble"}
    assert np.abs(drive.attitude[:, :2]).max() > 0.2


DITCH = {"kind": "ditch", "lines": [[[2.5, -6], [2.5, 6]]], "width": 1.0, "depth": [0.4, 0.4]}


def test_a_ditch_is_as_deep_and_as_wide_as_it_says() -> None:
    ground = {"cover": "soil", "amplitude": 0.0, "cell": 0.125}
    world = world_with(DITCH, ground=ground)
    across = np.linspace(1.0, 4.0, 601)
    level = world.ground.height(across, np.zeros(601))
    assert level.min() == pytest.approx(-0.4)
    assert level[np.abs(across - 2.5) > 0.5].max() == 0.0
    assert np.all(level[np.abs(across - 2.5) > 0.63] == 0.0)
    assert np.ptp(across[level < -0.2]) == pytest.approx(1.0 - 0.25, abs=0.06)
    assert "ditch" in pixels(world)


def test_the_near_edge_of_a_ditch_returns_nothing_but_is_seen() -> None:
    world, flat = world_with(DITCH), world_with()
    points, bare = cloud(world), cloud(flat)
    # The lowest beam meets level ground at 3.17 m from the lidar and passes over the ditch.
    ring = 0.2 + EYE / math.tan(math.radians(15.0))
    assert ring > 3.0
    nearest = [
        one["x"][np.abs(np.arctan2(one["y"], one["x"])) < 0.3].min() for one in (points, bare)
    ]
    assert nearest[0] == nearest[1] > 2.8
    assert (pixels(world) == "ditch").sum() > 5000


def test_a_robot_is_held_at_the_edge_of_a_ditch_and_tips_into_it(scripted: DriveOf) -> None:
    drive = scripted(world_with(DITCH), [Leg(8.0, 0.5, 0.0)])
    assert [event.kind for event in true_events(drive)] == ["stuck"]
    front = drive.position[-1, 0] + 0.55
    assert 2.0 < front < 2.5
    assert drive.attitude[-1, 1] > 0.05


def test_high_leaves_throw_a_shadow_and_nothing_else(scripted: DriveOf, spot: Robot) -> None:
    high = {"kind": "hanging_leaves", "at": [[2.0, 0.0]], "radius": [1.5, 1.5]}
    high |= {"bottom": [4, 4], "top": [5, 5], "leaf_area_density": [4, 4]}
    zenith = Light("clear", np.array([0.0, 0.0, 1.0]), 4e4, 1e4)
    shaded, bare = world_with(high), world_with()
    assert picture(shaded, zenith)[150:].mean() < 0.8 * picture(bare, zenith)[150:].mean()
    assert len(cloud(shaded)) == len(cloud(bare))
    one, other = (scripted(world, [Leg(6.0, 0.5, 0.1)]) for world in (shaded, bare))
    assert one.position.tobytes() == other.position.tobytes()
    assert spot.base_height == BASE


def test_a_ditch_too_narrow_for_the_ground_is_refused() -> None:
    with pytest.raises(Exception, match=r"narrower than three cells of the ground, 0\.5 m each"):
        world_with(DITCH, ground={"cell": 0.5})
