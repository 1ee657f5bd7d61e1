"""``graspe label propose``: drafts for people, whose verdicts then stand."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner, Result

from graspe_data.observation.labels import Annotation, annotation_path, read_annotation
from graspe_data.recordings import recording_digest
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.recorded_truth import read_truth
from pipelines.command_line import app
from pipelines.dataset_settings import DatasetRecipe
from tests.pipelines.conftest import RecordingFactory

STUCK_LEGS = (Leg(5.0, 0.6, 0.0), Leg(0.5, -0.4, 0.0))
FREE_LEGS = (Leg(2.0, 0.6, 0.0),)


@pytest.fixture
def stuck(record: RecordingFactory) -> Path:
    """A recording in which the robot is stuck in a bush."""
    return record(legs=STUCK_LEGS)


@pytest.fixture
def manifest(recipe: DatasetRecipe, tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(yaml.safe_dump(recipe.dataset.model_dump(mode="json")))
    return path


def propose(manifest: Path, *recordings: object) -> Result:
    words = ["label", "propose", str(manifest), "--recordings", *map(str, recordings)]
    return CliRunner().invoke(app, words)


def verdict(path: Path, number: int, **changes: object) -> None:
    """Do what a person does in an editor."""
    content = yaml.safe_load(path.read_text())
    content["intervals"][number] |= changes
    path.write_text(yaml.safe_dump(content))


def kinds(annotation: Annotation) -> list[tuple[str, str]]:
    return [(interval.kind, interval.verdict) for interval in annotation.intervals]


def test_the_draft_lies_beside_the_recording_and_is_about_it(stuck: Path, manifest: Path) -> None:
    result = propose(manifest, stuck)
    assert (result.exit_code, result.stderr) == (0, "")
    path = annotation_path(stuck)
    assert f"{path}: " in result.stdout
    digest = recording_digest(stuck)
    draft = read_annotation(path, digest)
    assert (draft.recording, draft.sha256) == (stuck.name, digest)
    assert ("stuck", "proposed") in kinds(draft)
    held = next(interval for interval in draft.intervals if interval.kind == "stuck")
    found, (true,) = draft.event(held), read_truth(stuck).events
    assert found.start_ns == pytest.approx(true.start_ns, abs=2e8)
    assert found.stop_ns == pytest.approx(true.stop_ns, abs=2e8)


def test_a_drive_without_failures_has_a_file_without_intervals(
    record: RecordingFactory, manifest: Path
) -> None:
    path = record(legs=FREE_LEGS)
    assert "0 intervals to review of 0" in propose(manifest, path).stdout
    assert read_annotation(annotation_path(path)).intervals == ()


def test_proposing_again_leaves_the_file_byte_for_byte(stuck: Path, manifest: Path) -> None:
    propose(manifest, stuck)
    path = annotation_path(stuck)
    before, since = path.read_bytes(), path.stat().st_mtime_ns
    assert propose(manifest, stuck).exit_code == 0
    assert (path.read_bytes(), path.stat().st_mtime_ns) == (before, since)


def test_what_a_person_wrote_stays_byte_for_byte(stuck: Path, manifest: Path) -> None:
    propose(manifest, stuck)
    path = annotation_path(stuck)
    verdict(path, 0, verdict="confirmed", reviewer="Ann", note="a root")
    written = b"# Ann: seen from the car\n" + path.read_bytes() + b"\n# done\n"
    path.write_bytes(written)
    assert propose(manifest, stuck).exit_code == 0
    assert path.read_bytes() == written


@pytest.mark.parametrize("decision", ["confirmed", "rejected"])
def test_verdicts_are_kept_and_not_asked_about_again(
    stuck: Path, manifest: Path, recipe: DatasetRecipe, decision: str
) -> None:
    propose(manifest, stuck)
    path = annotation_path(stuck)
    first = read_annotation(path)
    number = kinds(first).index(("stuck", "proposed"))
    verdict(path, number, verdict=decision, reviewer="Ann", stop_s=5.0)
    changed = recipe.dataset.model_dump(mode="json")
    changed["proposals"]["stuck"]["moving_fraction"] = 0.1
    changed["proposals"]["stumble"] = None
    manifest.write_text(yaml.safe_dump(changed))
    assert propose(manifest, stuck).exit_code == 0
    again = read_annotation(path)
    assert [kind for kind, _ in kinds(again)].count("stuck") == 1
    kept = next(interval for interval in again.intervals if interval.kind == "stuck")
    assert (kept.verdict, kept.reviewer, kept.stop_s) == (decision, "Ann", 5.0)
    assert again.time_zero_ns == first.time_zero_ns


def test_what_a_person_added_stays(stuck: Path, manifest: Path) -> None:
    propose(manifest, stuck)
    path = annotation_path(stuck)
    content = yaml.safe_load(path.read_text())
    content["intervals"].append(
        {"start_s": 0.5, "stop_s": 0.7, "kind": "other", "verdict": "added", "reviewer": "Bo"}
    )
    path.write_text(yaml.safe_dump(content))
    before = kinds(read_annotation(path))
    assert propose(manifest, stuck).exit_code == 0
    assert sorted(kinds(read_annotation(path))) == sorted(before)


def test_proposals_that_nobody_reviewed_follow_the_rules_of_today(
    stuck: Path, manifest: Path, recipe: DatasetRecipe
) -> None:
    propose(manifest, stuck)
    path = annotation_path(stuck)
    assert ("stuck", "proposed") in kinds(read_annotation(path))
    changed = recipe.dataset.model_dump(mode="json")
    changed["proposals"]["stuck"] = None
    manifest.write_text(yaml.safe_dump(changed))
    result = propose(manifest, stuck)
    assert "stuck not judged: switched off" in result.stdout
    draft = read_annotation(path)
    assert "stuck" not in {kind for kind, _ in kinds(draft)}
    assert "switched off" in draft.not_judged["stuck"]


def test_several_recordings_stand_after_one_option(
    record: RecordingFactory, manifest: Path
) -> None:
    paths = [record(name, legs=FREE_LEGS) for name in ("a", "b", "c")]
    result = propose(manifest, *paths)
    assert result.exit_code == 0
    assert len(result.stdout.splitlines()) == 3
    assert all(annotation_path(path).is_file() for path in paths)


def test_a_folder_stands_for_the_recordings_in_it(record: RecordingFactory, manifest: Path) -> None:
    paths = [record(name, legs=FREE_LEGS) for name in ("a", "b")]
    assert propose(manifest, paths[0].parent).exit_code == 0
    assert all(annotation_path(path).is_file() for path in paths)


def test_a_bad_recording_stops_no_other_and_is_exit_code_3(
    record: RecordingFactory, manifest: Path
) -> None:
    bad, good = record.folder / "bad.bag", record("good", legs=FREE_LEGS)
    bad.write_text("no recording")
    result = propose(manifest, bad, good)
    assert result.exit_code == 3
    assert "bad.bag" in result.stderr
    assert "Traceback" not in result.stderr
    assert "good" in result.stdout
    assert annotation_path(good).is_file()
    assert not annotation_path(bad).exists()


def test_labels_that_are_no_labels_or_of_another_recording_are_refused_and_left(
    record: RecordingFactory, manifest: Path
) -> None:
    one, two, three = (record(name, legs=FREE_LEGS) for name in ("one", "two", "three"))
    annotation_path(one).write_text("intervals: {")
    annotation_path(two).write_text(f"sha256: {'f' * 64}\ntime_zero_ns: 0\n")
    before = [annotation_path(path).read_bytes() for path in (one, two)]
    result = propose(manifest, one, two, three)
    assert result.exit_code == 3
    assert "not valid YAML" in result.stderr
    assert "labels of another recording" in result.stderr
    assert [annotation_path(path).read_bytes() for path in (one, two)] == before
    assert annotation_path(three).is_file()
