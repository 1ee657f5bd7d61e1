"""Recordings whose bag time begins again, as of a simulation that gives the recorder its clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from graspe_data.recordings import open_recording
from graspe_data.recordings.writing import Container
from graspe_data.robot import Robot
from graspe_data.synchronisation.clocks import ClockSettings
from graspe_data.synchronisation.row_plan import SynchronisationSettings
from graspe_data.synchronisation.synchronised import SynchronisedRecording, synchronise
from tests.graspe_data.inspection.disagreeing_recordings import ROBOT
from tests.made_recordings import Drive, Entry, MadeRecording

SHORT = SynchronisationSettings(history_steps=10, history_step_s=0.1, horizon_s=1.0)
SLOW, FAST = MadeRecording(), MadeRecording(Drive(v=1.2, omega=0.0))


def synchronised(entries: list[Entry], path: Path, container: Container) -> SynchronisedRecording:
    MadeRecording(entries=entries).write(path, container, in_time=False)
    with open_recording(path) as recording:
        return synchronise(recording, Robot.model_validate(ROBOT), ClockSettings(), SHORT)


@pytest.mark.parametrize("runs", [(SLOW, FAST), (SLOW, FAST, SLOW)])
@pytest.mark.parametrize("container", ["bag", "db3", "mcap"])
def test_each_run_is_a_stretch_of_its_own(
    tmp_path: Path, container: Container, runs: tuple[MadeRecording, ...]
) -> None:
    path = tmp_path / ("drive.bag" if container == "bag" else "drive")
    entries = [entry for run in runs for entry in run.entries]
    found = synchronised(entries, path, container)
    history = found.plan.history[..., 0]
    assert found.plan.rows == 101 * len(runs)
    assert len(found.shifts_ns) == len(runs)
    assert np.ptp(history, axis=1).max() < 1e-6
    speeds = [run.drive.v for run in runs]
    np.testing.assert_allclose(history[::101, -1], speeds, atol=1e-6)
    assert np.all(np.diff(found.plan.anchor_ns) > 0)
