"""The command line: readable help, clear errors, documented exit codes, JSON that parses."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml

from graspe_data.simulation.motion.drivers import Leg
from pipelines.command_line import main
from pipelines.dataset_settings import DatasetRecipe
from tests.pipelines.conftest import RecordingFactory

COMMANDS = (
    (),
    ("inspect",),
    ("scaffold",),
    ("demo",),
    ("simulate",),
    ("dataset",),
    ("dataset", "build"),
    ("dataset", "info"),
    ("dataset", "verify"),
    ("dataset", "pack"),
    ("dataset", "report"),
    ("dataset", "picture"),
    ("label",),
    ("label", "propose"),
    ("label", "check"),
    ("label", "score"),
    ("zoo",),
    ("zoo", "list"),
    ("zoo", "train"),
    ("zoo", "evaluate"),
    ("zoo", "compare"),
    ("zoo", "run"),
)


@dataclass(frozen=True)
class Said:
    """What a command answered."""

    code: int
    out: str
    err: str


Run = Callable[..., Said]


@pytest.fixture
def graspe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Run:
    """Runs the command in a folder that holds an empty folder and a file of text."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    (tmp_path / "empty").mkdir()
    (tmp_path / "text").write_text("no recording")

    def run(*arguments: object) -> Said:
        monkeypatch.setattr(sys, "argv", ["graspe", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        result = capsys.readouterr()
        code = ended.value.code
        return Said(code if isinstance(code, int) else 0, result.out, result.err)

    return run


@pytest.fixture
def drive(record: RecordingFactory) -> Path:
    return record(legs=(Leg(3.5, 0.6, 0.1),))


@pytest.fixture
def manifest(recipe: DatasetRecipe, tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump(recipe.dataset.model_dump(mode="json")))
    return path


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_every_command_explains_itself(graspe: Run, command: tuple[str, ...]) -> None:
    result = graspe(*command, "--help")
    assert (result.code, result.err) == (0, "")
    assert f"Usage: {' '.join(('graspe', *command))}" in result.out
    assert max(map(len, result.out.splitlines())) <= 100


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ("dataset build field -r missing --out o", "missing: no such file or folder"),
        ("dataset build field -r empty --out o", "empty: no recording here or below"),
        ("dataset build feild -r text --out o", "Did you mean 'field'?"),
        ("dataset build field -r text --out o", "neither a ROS 1 bag"),
        ("dataset build field -r text --out text", "text: cannot be the dataset's folder"),
        ("dataset info empty", "empty is no finished dataset"),
        ("dataset info missing", "missing is no finished dataset"),
        ("dataset verify empty", "run it again to finish"),
        ("dataset report empty", "empty is no finished dataset"),
        ("dataset pack empty", "empty is no finished dataset"),
        ("dataset pack missing --out o.tar", "missing is no finished dataset"),
        ("demo --out text", "text"),
        ("scaffold missing", "missing: no such file or folder"),
        ("scaffold text", "neither a ROS 1 bag"),
        ("inspect text --robot spott", "Did you mean 'spot'?"),
        ("label propose field -r missing", "missing: no such file or folder"),
        ("label check missing", "missing: cannot be read"),
        ("label check empty", "empty: no labels file here or below"),
        ("label check text -r missing", "missing: no such file or folder"),
    ],
)
def test_a_mistake_is_one_clear_text_on_stderr(graspe: Run, arguments: str, text: str) -> None:
    result = graspe(*arguments.split())
    assert (result.code, result.out) == (1, "")
    assert text in result.err
    assert result.err.count("graspe: ") == 1
    assert "Traceback" not in result.err


@pytest.mark.parametrize(
    "arguments",
    [
        "nonsense",
        "dataset build field --out o",
        "dataset build field -r text --out o --workers 0",
        "dataset build field -r text --out o --wrkers 2",
        "dataset verify empty --against-bags -1",
    ],
)
def test_a_wrong_call_shows_the_usage(graspe: Run, arguments: str) -> None:
    result = graspe(*arguments.split())
    assert (result.code, result.out) == (2, "")
    assert "Usage: graspe" in result.err
    assert "Traceback" not in result.err


def test_an_unknown_key_suggests_the_known_one(graspe: Run, tmp_path: Path) -> None:
    (tmp_path / "wrong.yaml").write_text("name: x\nrobot: spot\nwindow: {anchor_rat: 3}\n")
    result = graspe("dataset", "build", "wrong.yaml", "-r", "text", "--out", "o")
    assert result.code == 1
    assert "window.anchor_rat: unknown key. Did you mean 'anchor_rate'?" in result.err


def test_a_dataset_from_build_to_verify(graspe: Run, drive: Path, manifest: Path) -> None:
    build = ("dataset", "build", manifest, "-r", drive, "--out", "o")
    built = graspe(*build, "--json")
    assert built.code == 0
    assert json.loads(built.out)["worked_on"] == ["drive"]
    assert json.loads(graspe(*build, "--json").out)["worked_on"] == []
    index = json.loads(graspe("dataset", "info", "o", "--json").out)
    assert index["dataset_digest"] == json.loads(built.out)["dataset_digest"]
    assert "drive" in graspe("dataset", "info", "o").out
    verified = graspe("dataset", "verify", "o", "--against-bags", "3", "-r", drive, "--json")
    assert verified.code == 0
    assert json.loads(verified.out) == {
        "faults": [],
        "rows_derived_again": 3,
        "not_given": [],
    }


def test_rows_against_recordings_need_the_recordings(
    graspe: Run, drive: Path, manifest: Path, record: RecordingFactory
) -> None:
    graspe("dataset", "build", manifest, "-r", drive, "--out", "o")
    result = graspe("dataset", "verify", "o", "--against-bags", "3")
    assert result.code == 1
    assert "--against-bags needs --recordings" in result.err
    other = record("other", seed=1, legs=(Leg(3.5, 0.6, 0.1),))
    result = graspe("dataset", "verify", "o", "--against-bags", "3", "-r", other)
    assert result.code == 1
    assert "none of the given recordings" in result.err


def test_a_fault_in_a_shard_is_exit_code_2(
    graspe: Run, drive: Path, manifest: Path, tmp_path: Path
) -> None:
    graspe("dataset", "build", manifest, "-r", drive, "--out", "o")
    shard = next((tmp_path / "o" / "shards").iterdir())
    content = bytearray(shard.read_bytes())
    with np.load(shard) as arrays:
        content[content.index(arrays["pose"].tobytes())] ^= 1
    shard.write_bytes(content)
    result = graspe("dataset", "verify", "o")
    assert result.code == 2
    assert shard.name in result.out
    assert "1 faults" in result.out


def test_a_refused_recording_is_exit_code_3(
    graspe: Run, drive: Path, manifest: Path, tmp_path: Path
) -> None:
    shutil.copy(tmp_path / "text", drive.parent / "bad.bag")
    result = graspe("dataset", "build", manifest, "-r", drive.parent, "--out", "o", "--json")
    assert result.code == 3
    assert list(json.loads(result.out)["refused"]) == ["bad.bag"]


def test_inspection_of_good_and_bad_recordings(graspe: Run, drive: Path) -> None:
    assert graspe("inspect", drive).code == 0
    result = graspe("inspect", drive, "text", "missing", "--json")
    assert result.code == 3
    assert [Path(found["path"]).name for found in json.loads(result.out)["recordings"]] == ["drive"]
    assert list(json.loads(result.out)["unreadable"]) == ["missing", "text"]


def test_the_installed_command() -> None:
    command = Path(sys.executable).with_name("graspe")
    if not command.is_file():
        pytest.skip("graspe is not installed beside this Python")
    result = subprocess.run(
        [command, "dataset", "info", "missing"], capture_output=True, check=False
    )
    assert result.returncode == 1
    assert result.stderr.startswith(b"graspe: missing/dataset.json: missing")


def test_ctrl_c_says_that_the_same_command_goes_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pipelines.commands.zoo._machine", interrupted)
    words = ["graspe", "zoo", "train", "paad", "--data", "data", "--out", "run"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 130
    assert "graspe: stopped. Run the same command again" in capsys.readouterr().err
