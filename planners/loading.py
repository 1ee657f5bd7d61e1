"""A bundle and a robot to a planner in service, in one call."""

from __future__ import annotations

from pathlib import Path

from graspe_data.calibration import Calibration, calibration_of
from graspe_data.robot import Robot, load_robot
from planners.bundle import load_bundle
from planners.fitness import GuardSettings
from planners.graspe_planner import GraspePlanner, GraspePlannerSettings
from planners.guarded import Guarded
from planners.scorer import Scorer


def load_planner(
    bundle: str | Path,
    robot: str | Path | Robot,
    *,
    calibration: Calibration | None = None,
    settings: GraspePlannerSettings | None = None,
    guard: GuardSettings | None = None,
    threads: int = 1,
) -> Guarded:
    """Load a bundle for a robot, refuse a robot that is not the bundle's, and guard the planner.

    Args:
        bundle: Its folder.
        robot: A robot manifest: its path, the name of one that ships, or what was read of it.
        calibration: Where the manifest leaves intrinsics or mountings to what the robot publishes;
            None takes the manifest's numbers.
        settings: Of the planner.
        guard: Of what stops it.
        threads: Of onnxruntime.

    Returns:
        A planner whose ``command`` never raises.

    Raises:
        PlannerError: The bundle is damaged, or the robot is not the one that it was made for.
        ManifestError: The robot's manifest does not validate.
    """
    robot_model = robot if isinstance(robot, Robot) else load_robot(robot)
    sensors = calibration_of(robot_model) if calibration is None else calibration
    scorer = Scorer(load_bundle(bundle, threads=threads), sensors)
    return Guarded(GraspePlanner(robot_model, scorer, settings), robot_model.limits, guard)
