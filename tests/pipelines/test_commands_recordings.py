from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from graspe_data.errors import RecordingError
from graspe_data.manifest import load_manifest
from graspe_data.robot import Robot
from pipelines import command_line

Record = Callable[..., Path]


@pytest.fixture
def app() -> typer.Typer:
    return command_line.app


def test_inspect_prints_a_block_a_recording(app: typer.Typer, record: Record) -> None:
    path = record()
    result = CliRunner().invoke(app, ["inspect", str(path)], env={"COLUMNS": "100"})
    assert result.exit_code == 0
    assert "/velodyne_points  points" in result.stdout
    assert "can make rows: yes" in result.stdout
    assert max(map(len, result.stdout.splitlines())) <= 100


def test_inspect_prints_json(app: typer.Typer, record: Record) -> None:
    paths = [record("one", "bag"), record("two", "db3")]
    result = CliRunner().invoke(app, ["inspect", "--json", *map(str, paths)])
    found = json.loads(result.stdout)
    assert [Path(entry["path"]).name for entry in found["recordings"]] == ["one.bag", "two"]
    assert found["unreadable"] == {}


def test_one_unreadable_recording_stops_no_other(
    app: typer.Typer, record: Record, tmp_path: Path
) -> None:
    broken = tmp_path / "broken.db3"
    broken.write_text("nothing")
    paths = [str(broken), str(tmp_path / "absent"), str(record())]
    result = CliRunner().invoke(app, ["inspect", *paths])
    assert result.exit_code == 3
    assert "can make rows: yes" in result.stdout
    assert result.stdout.count("cannot be read: ") == 2


def test_a_robot_manifest_is_judged_by(app: typer.Typer, record: Record) -> None:
    result = CliRunner().invoke(app, ["inspect", "--robot", "kitti_car", str(record())])
    assert result.exit_code == 0
    assert "can make rows: no" in result.stdout


def test_scaffold_writes_a_manifest_that_loads_and_overwrites_none(
    app: typer.Typer, record: Record, tmp_path: Path
) -> None:
    path, out = record(), tmp_path / "robot.yaml"
    arguments = ["scaffold", str(path), "--out", str(out)]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert load_manifest(out, Robot).topics.points == "/velodyne_points"
    again = CliRunner().invoke(app, arguments)
    assert isinstance(again.exception, RecordingError)
    assert "exists already" in str(again.exception)


def test_scaffold_takes_the_only_recording_below_a_folder(app: typer.Typer, record: Record) -> None:
    folder = record("one").parent
    alone = CliRunner().invoke(app, ["scaffold", str(folder.parent)])
    assert alone.exit_code == 0
    assert "name: one" in alone.stdout
    record("two", "db3")
    several = CliRunner().invoke(app, ["scaffold", str(folder)])
    assert isinstance(several.exception, RecordingError)
    for expected in ("2 recordings", str(folder / "one"), str(folder / "two")):
        assert expected in str(several.exception)


def test_a_drift_carries_its_unit(app: typer.Typer, record: Record) -> None:
    result = CliRunner().invoke(app, ["inspect", str(record())], env={"COLUMNS": "200"})
    drifts = re.findall(r"drift \S+ ?(.*)", result.stdout)
    assert drifts
    assert all(re.match(r"(ms|s)\b", unit) for unit in drifts)


def test_scaffold_prints_without_a_file(app: typer.Typer, record: Record) -> None:
    result = CliRunner().invoke(app, ["scaffold", str(record())])
    assert result.exit_code == 0
    assert result.stdout.startswith("# A robot manifest")
