"""A wheel, installed alone in an empty folder, finds what ships with it."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOOK = """
import json
from graspe_data import manifest
from pipelines.dataset_settings import load_recipe
found = [manifest.find_manifest("datasets", "field"), manifest.find_manifest("robots", "spot")]
print(json.dumps([manifest.__file__, *map(str, found), load_recipe("kitti_street").robot.name]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel built from this checkout, by the backend that is here or by one that pip fetches."""
    folder = tmp_path_factory.mktemp("wheel")
    ways = (
        ("build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)),
        ("pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(ROOT)),
    )
    faults = []
    for way in ways:
        done = _python("-m", *way)
        if done.returncode == 0:
            return next(folder.glob("graspe-*.whl"))
        faults.append((done.stderr + done.stdout).strip().splitlines()[-1])
    pytest.skip(f"no wheel can be built here: {'; '.join(faults)}")


def test_the_wheel_holds_all_that_ships(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    shipped = [path.relative_to(ROOT) for path in (ROOT / "manifests").glob("*/*.yaml")]
    assert shipped
    assert {f"graspe_data/{path.as_posix()}" for path in shipped} <= names
    assert "graspe_data/py.typed" in names
    report = {path.name for path in (ROOT / "pipelines/report").iterdir() if path.is_file()}
    assert {f"pipelines/report/{name}" for name in report} <= names
    assert not [name for name in names if name.startswith(("tests/", "benchmarks/"))]


def test_an_installed_wheel_finds_its_manifests(wheel: Path, tmp_path: Path) -> None:
    target = tmp_path / "installed"
    done = _python(
        *("-m", "pip", "install", "--quiet", "--no-deps", "--no-index"),
        *("--target", str(target), str(wheel)),
    )
    assert done.returncode == 0, done.stderr
    result = _python("-c", LOOK, cwd=tmp_path, first=target)
    assert result.returncode == 0, result.stderr
    assert result.stdout.count(str(target)) == 3
    assert "kitti" in result.stdout
    command = _python(str(target / "bin" / "graspe"), "--help", cwd=tmp_path, first=target)
    assert command.returncode == 0, command.stderr
    assert "Usage: graspe" in command.stdout


def _python(
    *arguments: str, cwd: Path = ROOT, first: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run this Python with a folder first on its path."""
    environment = {**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_RETRIES": "1"}
    if first is not None:
        environment["PYTHONPATH"] = str(first)
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
