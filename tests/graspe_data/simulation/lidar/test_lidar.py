"""Turns of the lidar in worlds of a few plates, against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.recordings.decoding import decode_points
from graspe_data.robot import Mounting
from graspe_data.simulation.lidar.beams import POINT_TYPE, firings_of_turn
from graspe_data.simulation.lidar.lidar import Lidar
from graspe_data.simulation.lidar.occlusion import SectorOcclusion
from graspe_data.simulation.lidar.settings import LidarSettings
from graspe_data.simulation.ray_scene import RayScene
from graspe_data.simulation.world.materials import MATERIALS, MaterialName
from graspe_data.simulation.world.mesh import Mesh, join_meshes, mesh_of
from graspe_data.simulation.world.obstacles import Obstacles
from graspe_data.simulation.world.world import Ground, World

Pose = Callable[[float], Transform]
HEIGHT = 1.5
EXACT: dict[str, Any] = {
    "mounting": Mounting(translation=(0.0, 0.0, 0.0)),
    "range_noise": 0.0,
    "intensity_noise": 0.0,
    "dropout": 0.0,
}


def plate(corner: Any, first: Any, second: Any, material: MaterialName = "concrete") -> Mesh:
    """A parallelogram from a corner along two edges."""
    start, one, two = (np.asarray(vector, np.float64) for vector in (corner, first, second))
    vertices = np.stack([start, start + one, start + one + two, start + two])
    return mesh_of(vertices, np.array([[0, 1, 2], [0, 2, 3]]), material)


def wall(x: float, material: MaterialName = "concrete", y: tuple[float, float] = (-90, 90)) -> Mesh:
    return plate((x, y[0], -50.0), (0.0, y[1] - y[0], 0.0), (0.0, 0.0, 100.0), material)


FLOOR = plate((-200, -200, 0), (400, 0, 0), (0, 400, 0), "floor")


def lidar(*plates: Mesh, **changed: Any) -> Lidar:
    mesh = join_meshes(plates)
    flat = Ground(np.zeros((2, 2)), (0.0, 0.0), 1.0)
    materials = tuple(MATERIALS.values())
    nowhere = (0.0, 0.0, 0.0)
    world = World(mesh, materials, Obstacles.of([]), flat, (-9.0, -9.0, 9.0, 9.0), nowhere)
    settings = LidarSettings.model_validate({**EXACT, **changed})
    return Lidar(world, RayScene(mesh, threads=1), settings)


def standing(_time_s: float) -> Transform:
    return Transform(np.eye(3), np.array([0.0, 0.0, HEIGHT]))


def turn(sensor: Lidar, pose: Pose = standing, seed: int = 0) -> NDArray[np.void]:
    return sensor.turn(0.0, pose, np.random.default_rng(seed))


def positions(points: NDArray[np.void]) -> NDArray[np.float64]:
    return np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)


def ranges(points: NDArray[np.void]) -> NDArray[np.float64]:
    away: NDArray[np.float64] = np.linalg.norm(positions(points), axis=1)
    return away


def ahead(points: NDArray[np.void], half_angle: float = 0.5) -> NDArray[np.void]:
    kept: NDArray[np.void] = points[np.abs(np.arctan2(points["y"], points["x"])) < half_angle]
    return kept


def test_the_floor_is_the_height_over_the_sine_away_for_every_lower_ring() -> None:
    points = turn(lidar(FLOOR, sub_rays=1, faintest_share=0.0))
    assert np.unique(points["ring"]).tolist() == list(range(8))
    depression = np.radians(15.0 - 2.0 * points["ring"])
    np.testing.assert_allclose(ranges(points), HEIGHT / np.sin(depression), rtol=2e-5)
    np.testing.assert_allclose(points["z"], -HEIGHT, rtol=2e-5)
    assert len(points) == 8 * 1808


def test_a_wall_is_flat_for_all_rings() -> None:
    points = ahead(turn(lidar(wall(7.0), sub_rays=1)))
    assert np.unique(points["ring"]).tolist() == list(range(16))
    np.testing.assert_allclose(points["x"], 7.0, rtol=1e-5)


def test_the_width_of_the_beam_moves_the_range_by_less_than_a_millimetre_head_on() -> None:
    points = ahead(turn(lidar(wall(7.0), sub_rays=9)))
    np.testing.assert_allclose(points["x"], 7.0, atol=1e-3)


def test_intensity_falls_with_the_cosine_of_incidence() -> None:
    points = ahead(turn(lidar(wall(7.0))), 1.3)
    cosine = points["x"] / ranges(points)
    expected = 255 * MATERIALS["concrete"].reflectivity * cosine
    np.testing.assert_allclose(points["intensity"], expected, atol=0.51 + 0.2)
    assert np.array_equal(points["intensity"], np.rint(points["intensity"]))


def half_hit(gap: float, **changed: Any) -> NDArray[np.void]:
    """A turn whose beams, 12 cm wide at 40 m, meet slats of 10 cm there or the wall behind."""
    slats = [plate((40, y, -50), (0, 0.1, 0), (0, 0, 100)) for y in np.arange(-8, 8, 0.2)]
    sensor = lidar(*slats, wall(40.0 + gap), sub_rays=9, faintest_share=0.0, **changed)
    return ahead(turn(sensor), 0.19)


def test_two_plates_within_a_pulse_give_one_return_between_them() -> None:
    gap = 0.2
    points = half_hit(gap)
    share = (40.0 + gap - points["x"]) / gap
    mixed = (share > 0.05) & (share < 0.95)
    assert mixed.sum() > 100
    ninths = share[mixed] * 9
    np.testing.assert_allclose(ninths, np.rint(ninths), atol=0.12)
    assert abs(share[mixed].mean() - 0.5) < 0.03
    incidence = points["x"] / ranges(points)
    full = 255 * MATERIALS["concrete"].reflectivity
    np.testing.assert_allclose(points["intensity"], full * incidence, atol=1.0)


def test_two_plates_farther_apart_give_the_stronger_with_its_share_of_the_beam() -> None:
    points = half_hit(2.0)
    near = np.abs(points["x"] - 40.0) < 0.02
    assert np.all(near | (np.abs(points["x"] - 42.0) < 0.02))
    full = 255 * MATERIALS["concrete"].reflectivity * points["x"] / ranges(points)
    share = points["intensity"] / full
    ninths = share * 9
    np.testing.assert_allclose(ninths, np.rint(ninths), atol=0.06)
    assert share.min() > 0.5


def test_last_returns_prefer_what_is_behind() -> None:
    strongest, last = half_hit(2.0), half_hit(2.0, returns="last")
    assert len(last) == len(strongest)
    mixed = last["intensity"] < strongest["intensity"]
    assert mixed.sum() > 50
    assert np.all(last["x"] >= strongest["x"] - 1e-3)
    assert np.all(np.abs(last["x"][mixed] - 42.0) < 0.02)


def test_dual_returns_follow_one_another_at_the_same_firing() -> None:
    strongest, dual = half_hit(2.0), half_hit(2.0, returns="dual")
    again = np.flatnonzero(np.diff(dual["time"]) == 0) + 1
    assert len(again) > 100
    assert np.array_equal(np.delete(dual, again), strongest)
    assert np.all(dual["intensity"][again] <= dual["intensity"][again - 1])
    np.testing.assert_allclose(np.abs(dual["x"][again] - dual["x"][again - 1]), 2.0, atol=0.02)


def test_a_wall_behind_glass_keeps_the_transmission_squared() -> None:
    bare, glazed = (
        ahead(turn(lidar(wall(9.0), *panes, returns="last")))
        for panes in ([], [wall(4.0, "glass")])
    )
    np.testing.assert_allclose(glazed["x"], bare["x"], atol=1e-3)
    kept = MATERIALS["glass"].transmission ** 2
    np.testing.assert_allclose(glazed["intensity"], kept * bare["intensity"], atol=1.0)


def test_a_pane_is_seen_only_near_normal_incidence() -> None:
    points = ahead(turn(lidar(wall(4.0, "glass"), faintest_share=0.0)))
    incidence = np.degrees(np.arccos(points["x"] / ranges(points)))
    np.testing.assert_allclose(points["x"], 4.0, atol=1e-3)
    assert 10.0 < incidence.max() < 13.0
    lobe = 255 * MATERIALS["glass"].reflectivity * np.exp(-((incidence / 4.0) ** 2))
    np.testing.assert_allclose(points["intensity"], lobe, atol=0.8)


def test_of_glass_and_wall_the_stronger_is_reported() -> None:
    points = ahead(turn(lidar(wall(4.0, "glass"), wall(9.0, "soil"))))
    incidence = np.degrees(np.arccos(points["x"] / ranges(points)))
    glass, soil = MATERIALS["glass"], MATERIALS["soil"]
    behind = glass.transmission**2 * soil.reflectivity
    turning = 4.0 * np.sqrt(np.log(glass.reflectivity / behind))
    pane = points["x"] < 6.0
    assert incidence[pane].max() < turning + 0.1
    assert incidence[~pane].min() > turning - 0.1


def test_faint_returns_are_lost_far_away() -> None:
    points = turn(lidar(FLOOR, faintest_share=0.1))
    depression = np.radians(15.0 - 2.0 * np.arange(8))
    away = HEIGHT / np.sin(depression)
    energy = MATERIALS["floor"].reflectivity * np.sin(depression)
    expected = np.flatnonzero(energy >= 0.1 * (away / 50.0) ** 2)
    assert np.unique(points["ring"]).tolist() == expected.tolist() == list(range(6))


def test_dropout_is_the_share_lost_at_the_limit_and_falls_with_the_energy() -> None:
    share = MATERIALS["concrete"].reflectivity * 0.5
    whole = turn(lidar(wall(50.0), faintest_share=share))
    kept = turn(lidar(wall(50.0), faintest_share=share, dropout=0.6))
    strength = MATERIALS["concrete"].reflectivity * whole["x"] / ranges(whole)
    lost = 0.6 * share * (ranges(whole) / 50.0) ** 2 / strength
    deviation = np.sqrt((lost * (1 - lost)).sum())
    assert abs((len(whole) - len(kept)) - lost.sum()) < 4 * deviation


def test_nearer_and_farther_than_the_limits_nothing_is_reported() -> None:
    near = lidar(wall(0.3, y=(-0.5, 0.5)), wall(20.0), wall(-50.0), faintest_share=0.0)
    points = turn(near)
    assert ranges(points).min() > 0.4
    assert not len(ahead(points, 0.5))
    assert ranges(turn(lidar(FLOOR, faintest_share=0.0, maximum_range=12.0))).max() < 12.0


def test_the_range_noise_has_its_standard_deviation() -> None:
    points = ahead(turn(lidar(wall(7.0), range_noise=0.02, sub_rays=1)))
    bare = ahead(turn(lidar(wall(7.0), sub_rays=1)))
    noise = ranges(points) - ranges(bare)
    assert abs(noise.std() - 0.02) < 4 * 0.02 / np.sqrt(2 * len(noise))
    assert abs(noise.mean()) < 4 * 0.02 / np.sqrt(len(noise))


def test_the_intensity_noise_has_its_standard_deviation() -> None:
    points = ahead(turn(lidar(wall(7.0), intensity_noise=6.0)))
    bare = ahead(turn(lidar(wall(7.0))))
    noise = points["intensity"] - bare["intensity"]
    assert abs(noise.std() - 6.0) < 4 * 6.0 / np.sqrt(2 * len(noise)) + 0.05


def test_the_same_seed_gives_the_same_bytes() -> None:
    noisy = {"range_noise": 0.01, "intensity_noise": 2.0, "dropout": 0.5}
    first, again, other = (
        turn(lidar(FLOOR, wall(7.0), **noisy), seed=seed).tobytes() for seed in (1, 1, 2)
    )
    assert first == again
    assert first != other


def test_a_drive_towards_a_wall_shortens_ranges_as_it_goes() -> None:
    speed = 3.0
    sensor = lidar(wall(7.0), sub_rays=1)

    def driving(time_s: float) -> Transform:
        return Transform(np.eye(3), np.array([speed * time_s, 0.0, HEIGHT]))

    points = ahead(turn(sensor, driving))
    np.testing.assert_allclose(points["x"], 7.0 - speed * points["time"], rtol=1e-5)
    still = ahead(turn(lidar(wall(7.0), sub_rays=1, motion_distortion=False), driving))
    np.testing.assert_allclose(still["x"], 7.0, rtol=1e-5)


def test_a_turn_on_the_spot_shears_the_cloud_by_the_yaw_at_each_firing() -> None:
    rate = 1.2
    sensor = lidar(wall(7.0), sub_rays=1)

    def turning(time_s: float) -> Transform:
        return Transform(rotation_from_rpy(0.0, 0.0, rate * time_s), np.array([0.0, 0.0, HEIGHT]))

    points = ahead(turn(sensor, turning))
    yaw = rate * points["time"].astype(np.float64)
    back = points["x"] * np.cos(yaw) - points["y"] * np.sin(yaw)
    np.testing.assert_allclose(back, 7.0, rtol=2e-5)


def test_the_mounting_moves_the_sensor_on_the_robot() -> None:
    mounting = Mounting(translation=(0.2, 0.0, 0.35), rotation_rpy=(0.0, 0.0, np.pi / 2))
    sensor = lidar(wall(7.0), sub_rays=1, mounting=mounting)
    assert sensor.base_from_lidar.translation.tolist() == [0.2, 0.0, 0.35]
    points = turn(sensor)
    np.testing.assert_allclose(points["y"], -6.8, rtol=1e-4)


def test_a_covered_sector_returns_nothing_and_the_rest_is_as_before() -> None:
    sensor = lidar(FLOOR)
    sector = SectorOcclusion(0.5, 1.2)
    covered = sensor.turn(0.0, standing, np.random.default_rng(0), sector)
    bare = turn(sensor)
    azimuth = np.arctan2(bare["y"], bare["x"])
    assert np.array_equal(covered, bare[(azimuth < 0.5) | (azimuth >= 1.2)])


def test_under_the_open_sky_the_cloud_is_empty() -> None:
    points = turn(lidar(wall(-150.0)))
    assert points.shape == (0,)
    assert points.dtype == POINT_TYPE


def test_points_come_in_firing_order_with_the_drivers_22_bytes() -> None:
    points = turn(lidar(wall(7.0), sub_rays=1))
    assert points.dtype == POINT_TYPE
    offsets = {name: field[1] for name, field in (POINT_TYPE.fields or {}).items()}
    assert offsets == {"x": 0, "y": 4, "z": 8, "intensity": 12, "ring": 16, "time": 18}
    assert POINT_TYPE.itemsize == 22
    assert np.all(np.diff(points["time"]) > 0)
    firings = firings_of_turn(10.0)
    fired = np.searchsorted(firings.time_s, points["time"].astype(np.float64) - 1e-7)
    assert np.array_equal(firings.ring[fired], points["ring"])


def test_the_cloud_is_read_back_with_rings() -> None:
    points = turn(lidar(FLOOR))
    kinds = {"x": 7, "y": 7, "z": 7, "intensity": 7, "ring": 4, "time": 7}
    fields = [
        SimpleNamespace(name=name, offset=field[1], datatype=kinds[name], count=1)
        for name, field in (POINT_TYPE.fields or {}).items()
    ]
    header = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=5), frame_id="velodyne")
    message = SimpleNamespace(
        header=header,
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=False,
        point_step=22,
        row_step=points.nbytes,
        data=points.view(np.uint8).ravel(),
        is_dense=True,
    )
    cloud = decode_points(message, "/velodyne_points")
    np.testing.assert_array_equal(cloud.xyz, positions(points).astype(np.float32))
    assert cloud.intensity is not None
    assert cloud.ring is not None
    np.testing.assert_array_equal(cloud.intensity, points["intensity"])
    np.testing.assert_array_equal(cloud.ring, points["ring"])
