"""Odometry topics that rows are not made of are held against themselves too."""

from __future__ import annotations

from pathlib import Path

import pytest

from graspe_data.inspection.inspection import inspect_recording
from graspe_data.synchronisation.findings import Finding
from tests.made_recordings import CLOUD, IMAGE, ODOMETRY, MadeRecording, Pose, odometry


def findings(path: Path) -> dict[tuple[str, str], Finding]:
    found = inspect_recording(path).verdict.findings
    return {(finding.where, finding.kind): finding for finding in found}


def test_an_odometry_beside_the_chosen_one_is_judged(tmp_path: Path) -> None:
    made = MadeRecording()
    empty = [("/z/odom", odometry(t, made.pose(t), (0.0, 0.0), 0.0), t + 1) for t in made.times(50)]
    told = findings(made.plus(empty).write(tmp_path / "two"))
    assert told[ODOMETRY, "motion_agrees"].course == "agrees"
    other = told["/z/odom", "twist_never_filled"]
    assert other.course == "noted"
    assert "/z/odom: twist says 0.0 m, poses say 7.2 m: the twist is empty" in other.text
    assert "(not used)" in other.text


def test_an_odometry_is_judged_where_there_are_no_rows(tmp_path: Path) -> None:
    made = MadeRecording().without(IMAGE, CLOUD)
    told = findings(made.write(tmp_path / "blind"))
    assert told[ODOMETRY, "motion_agrees"].numbers["twist_m"] == pytest.approx(7.2, abs=0.1)


def test_a_contradiction_is_told_and_stops_nothing(tmp_path: Path) -> None:
    made = MadeRecording()
    wrong = [
        ("/z/odom", odometry(t, Pose(0.0, made.pose(t).x, 0.0), (0.3, 1.7), 0.0), t + 1)
        for t in made.times(50)
    ]
    path = made.plus(wrong).write(tmp_path / "two")
    verdict = inspect_recording(path).verdict
    assert verdict.possible
    assert any(f.where == "/z/odom" and f.course == "noted" for f in verdict.findings)


@pytest.mark.parametrize(
    ("name", "topic", "kind", "metres"),
    [
        ("husky_odom_imu_gps_bz2.bag", "/husky_velocity_controller/odom", "motion_agrees", 358.8),
        ("zaki_scan_odom_tf_clockdrift.bag", "/odom", "motion_agrees", 15.7),
        (
            "embag_stage_scan_odom_lz4.bag",
            "/base_pose_ground_truth",
            "twist_in_fixed_frame",
            77.8,
        ),
        ("kitti_street_camera_lidar_odometry", "/odometry", "motion_agrees", 7.5),
    ],
)
def test_real_odometry(recordings: Path, name: str, topic: str, kind: str, metres: float) -> None:
    numbers = findings(recordings / name)[topic, kind].numbers
    assert numbers["twist_m"] == pytest.approx(metres, abs=0.1)
    assert numbers["poses_m"] == pytest.approx(metres, abs=0.2)
