"""Whether a robot is the one that a bundle was trained for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from graspe_data.bundle_contract import BundleContract
from graspe_data.calibration import Calibration
from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform, plain_frame
from graspe_data.manifest import Settings
from graspe_data.observation.undistortion import rectifier
from graspe_data.robot import Intrinsics, Robot

_PIXELS = ("fx", "fy", "cx", "cy")


class MatchSettings(Settings):
    """How far a robot may be from the bundle's."""

    pixels: float = 4.0
    """Of focal lengths and principal point, in the picture as the model sees it."""
    metres: float = 0.03
    """Of mountings, heights and the footprint."""
    radians: float = 0.03
    """Of mountings."""
    limits: float = 1e-3
    """m/s and rad/s that the robot's limits may be beyond those of the training data."""


def check_robot(
    contract: BundleContract,
    robot: Robot,
    calibration: Calibration,
    settings: MatchSettings | None = None,
) -> None:
    """Refuse a robot that is not the bundle's; a ``GraspePlanner`` begins with it.

    What the training data did not tell is not compared. A robot may be slower than the bundle's,
    not faster: of faster motions the model knows nothing. NaN matches nothing.

    Args:
        contract: Of the bundle.
        robot: Its footprint, base height, lidar and limits.
        calibration: Its sensors.
        settings: Tolerances.

    Raises:
        PlannerError: Names every difference, with what was found and expected.
    """
    tolerances = settings or MatchSettings()
    differences = [
        *_sensors(contract, calibration, tolerances),
        *_lidar(contract, robot, tolerances),
        *_body(contract, robot, tolerances),
        *_faster(contract, robot, tolerances),
    ]
    _refuse(differences, f"robot {robot.name}", contract)


def check_sensors(
    contract: BundleContract, calibration: Calibration, settings: MatchSettings | None = None
) -> None:
    """Refuse sensors that are not those of the bundle's robot; a ``Scorer`` begins with it.

    Raises:
        PlannerError: As ``check_robot``, of which this is a part.
    """
    differences = list(_sensors(contract, calibration, settings or MatchSettings()))
    _refuse(differences, "the calibration", contract)


def _refuse(differences: Sequence[str], who: str, contract: BundleContract) -> None:
    if differences:
        listed = "\n".join(f"  {difference}" for difference in differences)
        raise PlannerError(
            f"{who} does not match the bundle {contract.model}, trained for "
            f"{contract.robot.name}:\n{listed}\n"
            "Use a bundle that was trained for this robot, or correct the robot's manifest."
        )


def _sensors(
    contract: BundleContract, calibration: Calibration, tolerances: MatchSettings
) -> Iterator[str]:
    yield from _camera(contract, calibration, tolerances)
    yield from _mountings(contract, calibration, tolerances)
    for name in ("camera_frame", "lidar_frame"):
        found, expected = getattr(calibration, name), getattr(contract.robot, name)
        if None not in (found, expected) and plain_frame(found) != plain_frame(expected):
            yield f"{name}: {found}, expected {expected}"


def _lidar(contract: BundleContract, robot: Robot, tolerances: MatchSettings) -> Iterator[str]:
    expected, found = contract.observation.points, robot.lidar
    if None not in (expected.rings, found.rings) and found.rings != expected.rings:
        yield f"lidar.rings: {found.rings}, expected {expected.rings}"
    if not abs(found.minimum_range - expected.minimum_range) <= tolerances.metres:
        least = expected.minimum_range
        yield f"lidar.minimum_range: {found.minimum_range:g} m, expected {least:g} m"


def _camera(
    contract: BundleContract, calibration: Calibration, tolerances: MatchSettings
) -> Iterator[str]:
    expected = contract.robot.camera
    if expected is None:
        return
    height, width = contract.observation.picture_size
    found: Intrinsics = rectifier(calibration.intrinsics, (width, height)).intrinsics
    for name in _PIXELS:
        is_there, should_be = getattr(found, name), getattr(expected, name)
        if not abs(is_there - should_be) <= tolerances.pixels:
            yield f"camera {name}: {is_there:.1f} pixels, expected {should_be:.1f}"


def _mountings(
    contract: BundleContract, calibration: Calibration, tolerances: MatchSettings
) -> Iterator[str]:
    sensors = (
        ("camera", calibration.base_from_camera, contract.robot.base_from_camera),
        ("lidar", calibration.base_from_lidar, contract.robot.base_from_lidar),
    )
    for name, found, pose in sensors:
        if pose is not None:
            yield from _mounting(name, found, pose.transform(), tolerances)


def _mounting(
    name: str, found: Transform, expected: Transform, tolerances: MatchSettings
) -> Iterator[str]:
    if not np.linalg.norm(found.translation - expected.translation) <= tolerances.metres:
        yield (
            f"{name} mounting: at {_text(found.translation)} m, "
            f"expected {_text(expected.translation)} m"
        )
    if not np.allclose(found.rotation @ found.rotation.T, np.eye(3), atol=1e-3):
        yield f"{name} mounting: its rotation is none, its rows are not orthonormal"
    # The angle of a rotation follows from its trace.
    between = np.trace(found.rotation @ expected.rotation.T)
    angle = float(np.arccos(np.clip((between - 1) / 2, -1.0, 1.0)))
    if not angle <= tolerances.radians:
        yield f"{name} mounting: turned by {angle:.3f} rad against the bundle's"


def _body(contract: BundleContract, robot: Robot, tolerances: MatchSettings) -> Iterator[str]:
    expected = contract.robot
    sizes = (
        ("base_height", robot.base_height, expected.base_height),
        ("footprint length", robot.footprint.length, expected.footprint.length),
        ("footprint width", robot.footprint.width, expected.footprint.width),
    )
    for name, found, wanted in sizes:
        if not abs(found - wanted) <= tolerances.metres:
            yield f"{name}: {found:g} m, expected {wanted:g} m"


def _faster(contract: BundleContract, robot: Robot, tolerances: MatchSettings) -> Iterator[str]:
    for name in ("linear_velocity", "yaw_rate"):
        low, high = getattr(robot.limits, name)
        least, most = getattr(contract.robot.limits, name)
        if low < least - tolerances.limits or high > most + tolerances.limits:
            yield f"limits.{name}: {low:g}..{high:g}, expected within {least:g}..{most:g}"


def _text(values: Sequence[float] | np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in values) + ")"
