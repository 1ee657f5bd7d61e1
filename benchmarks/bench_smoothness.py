"""Equation (3) on a VLP-16 turn: ring order and smoothness against a KD-tree's neighbours."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.measurement import Measurement, render_table
from graspe_data.geometry import Transform
from graspe_data.observation.observe import observe_points
from graspe_data.observation.ring_order import ring_order
from graspe_data.observation.settings import PointObservationSettings
from graspe_data.observation.smoothness import smoothness
from graspe_data.sensor_data import PointCloud

NEIGHBOURS = 10
COLUMNS = 1800


def vlp16_turn(seed: int = 0) -> PointCloud:
    """28,800 returns in firing order: a courtyard with noise and a stretch of scattered grass."""
    generator = np.random.default_rng(seed)
    azimuth = np.repeat(np.linspace(np.pi, -np.pi, COLUMNS, endpoint=False), 16)
    elevation = np.tile(np.radians(np.arange(-15.0, 16.0, 2.0)), COLUMNS)
    reach = 8 / np.maximum(np.abs(np.cos(azimuth)), np.abs(np.sin(azimuth)))
    grass = np.abs(azimuth - 0.8) < 0.4
    reach = np.where(grass, 2 + generator.exponential(2, reach.size), reach)
    reach += generator.normal(0, 0.02, reach.size)
    level = np.cos(elevation)
    directions = np.stack(
        [level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], axis=1
    )
    xyz = (directions * reach[:, None]).astype(np.float32)
    ring = np.tile(np.arange(16), COLUMNS).astype(np.int32)
    strength = generator.uniform(0, 255, len(xyz)).astype(np.float32)
    return PointCloud(0, "velodyne", xyz, strength, ring)


def by_kd_tree(xyz: NDArray[np.float32]) -> NDArray[np.float64]:
    """Equation (3) with the ten nearest points for neighbours, as a first version would have it."""
    _, index = cKDTree(xyz).query(xyz, k=NEIGHBOURS + 1)
    difference = (xyz[:, None] - xyz[index[:, 1:]]).sum(axis=1)
    norm = np.linalg.norm(xyz, axis=1)
    return np.asarray(np.linalg.norm(difference, axis=1) / (norm * NEIGHBOURS), np.float64)


def sort_and_gather(cloud: PointCloud) -> Callable[[], object]:
    """The floor of equation (3): its keys sorted and its points gathered, both known beforehand."""
    azimuth = np.arctan2(cloud.xyz[:, 1], cloud.xyz[:, 0])
    steps = ((azimuth + np.pi) / (2 * np.pi) * ((1 << 24) - 1)).astype(np.uint64)
    assert cloud.ring is not None
    key = cloud.ring.astype(np.uint64) << np.uint64(24) | steps
    order = np.argsort(key)
    return lambda: (np.sort(key), cloud.xyz.take(order, axis=0))


def best_ms(work: Callable[[], object], repeats: int) -> float:
    """The least time of several, in milliseconds."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times) * 1000


def run(quick: bool) -> list[Measurement]:
    """Equation (3) alone, and a whole cloud's observation."""
    cloud, repeats = vlp16_turn(), 20 if quick else 100
    # Once a block of this size was freed, as in any build, malloc keeps what is freed; before, it
    # gives pages back to the system and faults them in again, call after call.
    np.ones(2 << 20)

    def ours() -> object:
        found = ring_order(cloud.xyz, cloud.ring, intensity=cloud.intensity)
        return smoothness(cloud.xyz.take(found.order, axis=0), found.ring_starts)

    mounting = Transform(np.eye(3), np.array([0.2, 0.0, 0.35]))
    settings = PointObservationSettings(minimum_range=0.45, base_height=0.5)
    tree = best_ms(lambda: by_kd_tree(cloud.xyz), max(3, repeats // 10))
    floor = best_ms(sort_and_gather(cloud), repeats)
    equation = best_ms(ours, repeats)
    return [
        Measurement(
            name="equation (3), 28,800 points, order included",
            value=equation,
            unit="ms",
            target=1.5,
            better="lower",
            note="one thread, any order of the message, malloc warm",
        ),
        Measurement(
            name="equation (3) against the floor",
            value=equation,
            unit="ms",
            peer="np.sort of the keys, gather of the points",
            peer_value=floor,
            better="lower",
            target=1.6,
            note="keys and order known beforehand; malloc warm",
        ),
        Measurement(
            name="equation (3) against a KD-tree",
            value=1 / equation,
            unit="clouds/ms",
            peer="scipy cKDTree, 10 nearest",
            peer_value=1 / tree,
            target=60,
            note=f"the tree takes {tree:.0f} ms",
        ),
        Measurement(
            name="a cloud to points, intensity, smoothness, scan",
            value=best_ms(lambda: observe_points(cloud, mounting, settings, 0), repeats),
            unit="ms",
            note="28,800 points, all of `observe_points`",
        ),
    ]


if __name__ == "__main__":
    print(render_table(run("--quick" in sys.argv)))
