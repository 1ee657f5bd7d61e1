"""Known points, motions and light make known pictures."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.arrays import Floats
from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.observation.image_reliability import ImageReliabilitySettings, image_reliability
from graspe_data.robot import Mounting
from graspe_data.simulation.camera.camera import Camera
from graspe_data.simulation.camera.lens_cover import LensCover
from graspe_data.simulation.camera.light import Light, LightSettings, Sky, draw_light
from graspe_data.simulation.camera.settings import CameraSettings
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.materials import Material
from graspe_data.simulation.world.mesh import Mesh
from graspe_data.simulation.world.world import World

UP = np.array([0.0, 0.0, 1.0])
STILL = (np.zeros(3), np.zeros(3))
LEVEL = Mounting(translation=(0.4, 0.0, 0.25))
SILENT = CameraSettings(
    mounting=LEVEL,
    softness=0,
    vibration=0,
    read_noise=0,
    denoising=0,
    sensitivity=1e6,
    full_well=1e6,
)
WHITE = Material((0.9, 0.9, 0.9), 0.0, 1.0, 1.0, "free")
BLACK = Material((0.0, 0.0, 0.0), 0.0, 1.0, 1.0, "free")
RELIABILITY = ImageReliabilitySettings()

Picture = NDArray[np.uint8]
Make = Callable[..., Mesh]
Scene = Callable[..., tuple[World, RayScene]]


def lit(lux: float, sky: Sky = "indoor") -> Light:
    chosen = LightSettings(
        illuminance_lux=(lux, lux), sky=sky, sun_elevation=(0.9, 0.9), sun_azimuth=(2.5, 2.5)
    )
    return draw_light(chosen, np.random.default_rng(0))


def linear(picture: Picture) -> Floats:
    """Undo sRGB's curve."""
    value = picture.astype(np.float64) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def standing(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, pitch: float = 0.0) -> Transform:
    return Transform(rotation_from_rpy(0.0, pitch, yaw), np.array([x, y, 0.5]))


@pytest.fixture(scope="module")
def plate(upright: Make, scenery: Scene) -> tuple[World, RayScene]:
    """A white plate 5 m ahead, 1.2 by 0.8 m, before black."""
    black = upright("soil", 5.02, (-60, 60), (-60, 60))
    white = upright("concrete", 5.0, (-0.5, 0.7), (0.4, 1.2))
    return scenery(black, white, soil=BLACK, concrete=WHITE)


@settings(max_examples=15, deadline=None)
@given(
    st.floats(-1.0, 1.5),
    st.floats(-0.5, 0.5),
    st.floats(-0.3, 0.3),
    st.floats(-0.2, 0.2),
    st.booleans(),
)
def test_known_points_lie_at_their_pixels(
    plate: tuple[World, RayScene], x: float, y: float, yaw: float, pitch: float, down: bool
) -> None:
    mounting = Mounting(translation=(0.4, 0.1, 0.25), rotation_rpy=(0.0, 0.2 * down, 0.0))
    camera = Camera(*plate, lit(400.0), SILENT.model_copy(update={"mounting": mounting}))
    pose = standing(x, y, yaw, pitch)
    picture = camera.picture(pose, STILL, np.random.default_rng(0))
    corners = np.array([[5, -0.5, 0.4], [5, 0.7, 0.4], [5, 0.7, 1.2], [5, -0.5, 1.2]])
    seen = (pose @ camera.base_from_camera).inverse().apply(corners) @ camera.intrinsics.matrix.T
    outline = (seen[:, :2] / seen[:, 2:]).astype(np.float32)
    white = picture[..., 1] > 60
    for v, u in np.argwhere(white ^ np.roll(white, 1, axis=1)):
        on_edge = max(abs(_outside(outline, u - shift, v)) for shift in (0, 1))
        assert on_edge < 1.5
    inside = np.array([[_outside(outline, u, v) > 0 for u in range(320)] for v in range(0, 240, 8)])
    assert (inside != white[::8]).sum() <= 2


def _outside(outline: NDArray[np.float32], u: int, v: int) -> float:
    """Pixels from the outline, positive inside."""
    return cv2.pointPolygonTest(outline, (float(u), float(v)), measureDist=True)


def test_the_calibration_is_that_of_the_field_of_view(plate: tuple[World, RayScene]) -> None:
    wide = CameraSettings(width=640, height=480, field_of_view=np.pi / 2)
    found = Camera(*plate, lit(400.0), wide).intrinsics
    assert (found.fx, found.fy) == pytest.approx((320.0, 320.0))
    assert (found.cx, found.cy) == (319.5, 239.5)
    assert found.distortion_model == "none"


def test_the_mounting_is_that_of_the_body_which_looks_along_its_x(
    plate: tuple[World, RayScene],
) -> None:
    mounted = Camera(*plate, lit(400.0), CameraSettings()).base_from_camera
    body = CameraSettings().mounting
    pitch = body.rotation_rpy[1]
    assert mounted.translation == pytest.approx(body.translation)
    ahead, right = mounted.rotation @ [0, 0, 1], mounted.rotation @ [1, 0, 0]
    assert ahead == pytest.approx([np.cos(pitch), 0.0, -np.sin(pitch)])
    assert right == pytest.approx([0.0, -1.0, 0.0])


@pytest.mark.parametrize("yaw_rate", [0.5, -1.0, 2.0])
def test_turning_draws_an_edge_out_over_its_angle(
    plate: tuple[World, RayScene], yaw_rate: float
) -> None:
    camera = Camera(*plate, lit(20.0), _slow())
    twist = (np.zeros(3), np.array([0, 0, yaw_rate]))
    # The lever of 0.4 m adds its own motion across: at 4.6 m it is omega 0.4 / 4.6.
    expected = camera.intrinsics.fx * abs(yaw_rate) * (1 + 0.4 / 4.6) * 0.033
    assert _ramp(camera, twist) == pytest.approx(expected, abs=1.2)


@pytest.mark.parametrize("speed", [2.0, -3.0, 6.0])
def test_moving_across_draws_an_edge_out_by_its_depth(
    plate: tuple[World, RayScene], speed: float
) -> None:
    camera = Camera(*plate, lit(20.0), _slow())
    twist = (np.array([0, speed, 0]), np.zeros(3))
    expected = camera.intrinsics.fx * abs(speed) * 0.033 / 4.6
    assert _ramp(camera, twist) == pytest.approx(expected, abs=1.2)


def _slow() -> CameraSettings:
    """Always at the longest exposure, and of so little sensitivity that nothing saturates."""
    return SILENT.model_copy(update={"sensitivity": 2e6, "full_well": 5e5, "target_grey": 0.9})


def _ramp(camera: Camera, twist: tuple[Floats, Floats]) -> float:
    """Width of the plate's left edge from black to white, pixels."""
    picture = camera.picture(standing(y=0.7), twist, np.random.default_rng(0))
    row = linear(picture[95:105, 100:220, 1]).mean(axis=0)
    rise = np.maximum.accumulate(row[:80] / row[75:90].mean())
    tenth, nine_tenths = np.interp([0.1, 0.9], rise, np.arange(80))
    return float(nine_tenths - tenth) / 0.8


def test_below_the_limits_the_picture_is_as_bright_as_the_light(
    plate: tuple[World, RayScene],
) -> None:
    greys = []
    for lux in (2.0, 4.0, 8.0):
        camera = Camera(*plate, lit(lux), CameraSettings(mounting=LEVEL, vibration=0))
        picture = camera.picture(standing(), STILL, np.random.default_rng(0))
        greys.append(linear(picture[110:116, 150:165, 1]).mean())
    assert greys[1] / greys[0] == pytest.approx(2.0, rel=0.1)
    assert greys[2] / greys[1] == pytest.approx(2.0, rel=0.05)


def test_above_the_limits_the_exposure_makes_up_for_the_light(
    plate: tuple[World, RayScene],
) -> None:
    means = []
    for lux in (2000.0, 60_000.0):
        camera = Camera(*plate, lit(lux), CameraSettings(mounting=LEVEL, vibration=0))
        means.append(camera.picture(standing(), STILL, np.random.default_rng(0)).mean())
    assert means[0] == pytest.approx(means[1], rel=0.02)


def test_the_same_seed_gives_the_same_bytes(plate: tuple[World, RayScene]) -> None:
    first, again, other = (
        Camera(*plate, lit(30.0), CameraSettings())
        .picture(standing(), STILL, np.random.default_rng(seed), LensCover(0.3, 1))
        .tobytes()
        for seed in (4, 4, 5)
    )
    assert first == again
    assert first != other


def test_noise_at_night_makes_no_corners(upright: Make, scenery: Scene) -> None:
    camera = Camera(
        *scenery(upright("concrete", 3.0, (-9, 9), (-9, 9))), lit(1.0), CameraSettings()
    )
    picture = camera.picture(standing(), STILL, np.random.default_rng(0))
    found = image_reliability(picture, RELIABILITY)
    assert found.r_corners < 0.02
    assert picture.std() > 0.3


@pytest.fixture(scope="module")
def thicket(level: Make, upright: Make, scenery: Scene) -> tuple[World, RayScene]:
    """Gravel, and small plates of several materials at random."""
    generator = np.random.default_rng(0)
    parts = [level("gravel")]
    for name in ("leaf", "wood", "concrete", "bush"):
        for _ in range(120):
            x, y, z, size = generator.uniform((2, -4, 0, 0.03), (9, 4, 2, 0.2))
            parts.append(upright(name, x, (y, y + size), (z, z + size)))
    return scenery(*parts, grain=True)


def test_r_img_falls_at_night_under_blur_and_under_a_cover(
    thicket: tuple[World, RayScene],
) -> None:
    def reliability(light: Light, cover: LensCover | None = None, yaw_rate: float = 0.0) -> float:
        camera = Camera(*thicket, light, CameraSettings())
        twist = (np.zeros(3), np.array([0, 0, yaw_rate]))
        picture = camera.picture(standing(), twist, np.random.default_rng(0), cover)
        return image_reliability(picture, RELIABILITY).r_img

    day = reliability(lit(5e4, "clear"))
    dusk = reliability(lit(30.0, "overcast"))
    assert day > 0.6
    assert dusk < 0.75 * day
    assert reliability(lit(30.0, "overcast"), yaw_rate=1.5) < 0.85 * dusk
    assert reliability(lit(1.0, "overcast")) < 0.1
    assert reliability(lit(5e4, "clear"), LensCover(0.9, 1)) < 0.75 * day
    assert reliability(lit(5e4, "clear"), LensCover(1.0, 1)) < 0.1
