"""Every kind of disagreement: what inspect says of it, that a build does the same, and the docs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from graspe_data.inspection.inspection import inspect_recording
from graspe_data.robot import Robot
from graspe_data.synchronisation.findings import KINDS
from pipelines.dataset_settings import DatasetManifest, DatasetRecipe
from pipelines.process_recording import RecordingTask, Refusal, process_recording
from tests.graspe_data.inspection.disagreeing_recordings import CASES, ROBOT

DOCS = Path(__file__).resolve().parents[3] / "docs" / "recordings.md"
BEGIN, END = "<!-- generated: disagreements -->\n", "<!-- end -->\n"
REFUSALS = {
    "camera_size": "is for",
    "optical_frame": "no optical frame",
    "motion_contradicts": "no frame explains it",
    "moves_sideways": "along the robot's x axis",
    "heading_never_filled": "its heading by none",
    "two_publishers": "two publishers",
    "limits_too_low": "limit",
    "never_filled": "never filled",
    "clocks_differ": "clocks differ",
    "camera_moves": "moves against",
    "no_mounting": "No transform",
}


def said(kind: str, folder: Path) -> str:
    """What inspect says of the recording of a kind."""
    case = CASES[kind]
    robot = Robot.model_validate({**ROBOT, **case.robot})
    verdict = inspect_recording(case.made().write(folder / kind), robot).verdict
    if kind in REFUSALS:
        assert not verdict.possible
        return next(reason for reason in verdict.reasons if REFUSALS[kind] in reason)
    found = next(finding for finding in verdict.findings if finding.kind == kind)
    assert found.course == KINDS[kind].course
    return found.text


def test_every_kind_has_a_recording() -> None:
    assert set(CASES) == set(KINDS)


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("kinds")
    return {kind: said(kind, folder) for kind in KINDS}


@pytest.mark.parametrize("kind", [*REFUSALS, "twist_in_fixed_frame", "stamps_begin_again"])
def test_a_build_does_what_inspect_says(kind: str, tmp_path: Path) -> None:
    case = CASES[kind]
    robot = Robot.model_validate({**ROBOT, **case.robot})
    path = case.made().write(tmp_path / "drive")
    recipe = DatasetRecipe(dataset=DatasetManifest(name="d", robot="made"), robot=robot)
    verdict = inspect_recording(path, robot).verdict
    outcome = process_recording(RecordingTask(path, recipe, tmp_path / "episodes"))
    if isinstance(outcome, Refusal):
        assert (verdict.possible, verdict.reasons[0] in outcome.reason) == (False, True)
    else:
        assert (verdict.possible, verdict.rows) == (True, outcome.extracted.rows)


def test_the_docs_hold_what_inspect_says(told: dict[str, str]) -> None:
    lines = ["| held against each other | what is done | what `inspect` says |", "|---|---|---|"]
    for kind, words in told.items():
        sources, done = KINDS[kind].sources, KINDS[kind].done
        course = ": ".join(filter(None, (f"*{KINDS[kind].course}*", done)))
        lines.append(f"| {sources} | {course} | {words.replace('|', '/')} |")
    text = DOCS.read_text(encoding="utf-8")
    head, _, rest = text.partition(BEGIN)
    _, _, tail = rest.partition(END)
    expected = head + BEGIN + "\n".join(lines) + "\n" + END + tail
    if os.environ.get("GRASPE_WRITE_DOCS"):
        DOCS.write_text(expected, encoding="utf-8")
    assert text == expected, "write it anew: GRASPE_WRITE_DOCS=1 pytest " + __file__
