"""``graspe label check``: every fault of a labels file in one go, each with its line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner, Result

from graspe_data.errors import GraspeError
from graspe_data.observation.labels import annotation_path, read_annotation
from graspe_data.simulation.motion.drivers import Leg
from pipelines.command_line import app
from pipelines.dataset_settings import DatasetRecipe
from pipelines.label_check import check_labels_file
from tests.pipelines.conftest import RecordingFactory

SOUND = """\
recording: field.bag
time_zero_ns: 1000
reviewer: Ann
intervals:
- {start_s: 1.0, stop_s: 2.0, kind: stuck, verdict: confirmed}
- {start_s: 1.5, stop_s: 3.0, kind: collision, verdict: added}
- {start_s: 2.5, stop_s: 3.0, kind: stuck, verdict: proposed}
"""
MANY = """\
recrding: field.bag
time_zero_ns: soon
sha256: 12
intervals:
- {start_s: 5.0, stop_s: 4.0, kind: stuck, verdict: proposed}
- {start_s: 1.0, stop_s: .nan, kind: stucked, verdict: proposed}
- start_s: 6.0
  stop_s: 7.0
  kind: stuck
  verdict: confirmed
- {start_s: 5.5, stop_s: 6.5, kind: stuck, verdict: rejected, reviewer: Bo}
- 7
- {stop_s: 7.0, kind: stuck, verdict: added, reviewer: Bo, verdict: added}
"""


def check(*words: object) -> Result:
    return CliRunner().invoke(app, ["label", "check", *map(str, words)])


@pytest.fixture
def labels(tmp_path: Path) -> Path:
    path = tmp_path / "field.bag.labels.yaml"
    path.write_text(SOUND)
    return path


def lines(result: Result, path: Path) -> list[int]:
    """The lines that were named, in order; 0 for the whole file."""
    heads = [line.removeprefix(f"{path}:") for line in result.stdout.splitlines()]
    return [int(head.partition(":")[0]) if head[0].isdigit() else 0 for head in heads[:-1]]


def test_a_sound_file_has_no_fault(labels: Path) -> None:
    completed = check(labels)
    assert (completed.exit_code, lines(completed, labels)) == (0, [])
    assert "0 faults; intervals: 1 confirmed, 1 added, 1 proposed" in completed.stdout


def test_every_fault_is_told_at_once_with_its_line(labels: Path) -> None:
    labels.write_text(MANY)
    completed = check(labels)
    assert completed.exit_code == 2
    report = dict.fromkeys(lines(completed, labels), "")
    for number, text in zip(lines(completed, labels), completed.stdout.splitlines(), strict=False):
        report[number] += text
    expected = {
        1: ["recrding: unknown key. Did you mean 'recording'?"],
        2: ["time_zero_ns: ", "'soon'"],
        3: ["sha256: "],
        5: ["stop_s 4.0 is before start_s 5.0"],
        6: ["intervals.1.stop_s: ", "intervals.1.kind: ", "'stumble'", "'stucked'"],
        10: ["intervals.2: confirmed, but by whom?"],
        11: ["starts at 5.5 s, before the one above it in line 7", "Put them in order"],
        7: ["intervals.2: confirmed stuck, 6 to 7 s, overlaps the rejected one", "line 11"],
        12: ["intervals.4: "],
        13: ["intervals.5.start_s: Field required", "the key 'verdict' is given twice"],
    }
    assert sorted(report) == sorted(expected)
    for number, texts in expected.items():
        for text in texts:
            assert text in report[number]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "expected a mapping with time_zero_ns and intervals, found nothing"),
        ("- 1\n", "found list"),
        ("nothing", "found str"),
        ("a: [", "not valid YAML"),
        ("a: &b 1\nc: *b\n", "not valid YAML: aliases"),
        ("[" * 5000, "not valid YAML"),
        ("!!python/object/apply:os.system [ls]", "not valid YAML"),
        ("time_zero_ns: 0\nintervals:\n", "intervals: expected a list, found nothing"),
        ("time_zero_ns: 0\nintervals: 3\n", "intervals: expected a list, found int"),
        ("intervals: []\n", "time_zero_ns: Field required"),
        ("time_zero_ns: 99999999999999999999\n", "time_zero_ns: "),
        ("time_zero_ns: 0\n1: 2\n", "should be"),
        ("time_zero_ns: 0\nrecording: other.bag\n", "recording: 'other.bag', but the file is"),
    ],
)
def test_a_file_of_another_form_is_told_in_words(labels: Path, text: str, fault: str) -> None:
    labels.write_text(text)
    completed = check(labels)
    assert completed.exit_code == 2
    assert fault in completed.stdout


@pytest.mark.parametrize("content", [b"\xff\xfe", b"x" * (5 << 20)])
def test_a_file_that_is_no_text_is_refused(labels: Path, content: bytes) -> None:
    labels.write_bytes(content)
    with pytest.raises(GraspeError, match=r"field\.bag\.labels\.yaml: (cannot be read|larger)"):
        check_labels_file(labels)


@pytest.mark.parametrize("name", ["field.yaml", "labels.yaml", ".labels.yaml"])
def test_a_name_that_no_build_finds_is_a_fault(labels: Path, name: str) -> None:
    other = labels.rename(labels.with_name(name))
    completed = check(other)
    assert completed.exit_code == 2
    assert "or no build finds it" in completed.stdout


def test_a_folder_is_looked_through(labels: Path, tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    faulty = tmp_path / "deep" / "field.bag.labels.yaml"
    faulty.write_text(SOUND.replace("stop_s: 2.0", "stop_s: 0.5"))
    completed = check(tmp_path, "--json")
    assert completed.exit_code == 2
    report = {entry["labels"]: entry for entry in json.loads(completed.stdout)}
    assert report[str(labels)]["faults"] == []
    assert [fault["line"] for fault in report[str(faulty)]["faults"]] == [5]
    (tmp_path / "empty").mkdir()
    assert "no labels file here or below" in str(check(tmp_path / "empty").exception)
    assert "missing.labels.yaml: cannot be read" in str(
        check(tmp_path / "missing.labels.yaml").exception
    )


def test_what_the_rules_propose_is_sound_against_its_recording(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path
) -> None:
    manifest = tmp_path / "small.yaml"
    manifest.write_text(yaml.safe_dump(recipe.dataset.model_dump(mode="json")))
    path = record(legs=(Leg(5.0, 0.6, 0.0), Leg(0.5, -0.4, 0.0)))
    CliRunner().invoke(app, ["label", "propose", str(manifest), "-r", str(path)])
    labels = annotation_path(path)
    assert read_annotation(labels).intervals
    for words in ((), ("-r", path), ("-r", path.parent, "--manifest", manifest)):
        completed = check(labels, *words)
        assert (completed.exit_code, lines(completed, labels)) == (0, [])
    assert f"held against {path}" in completed.stdout


@pytest.mark.parametrize("exact", [False, True])
def test_an_interval_must_lie_within_its_recording(
    record: RecordingFactory, recipe: DatasetRecipe, tmp_path: Path, exact: bool
) -> None:
    manifest = tmp_path / "small.yaml"
    manifest.write_text(yaml.safe_dump(recipe.dataset.model_dump(mode="json")))
    path = record(legs=(Leg(3.0, 0.6, 0.0),))
    CliRunner().invoke(app, ["label", "propose", str(manifest), "-r", str(path)])
    labels = annotation_path(path)
    content = yaml.safe_load(labels.read_text())
    spans = [(-2.0, 1.0), (0.5, 1.0), (2.0, 9.0), (50.0, 51.0)]
    content["intervals"] = [
        {"start_s": a, "stop_s": b, "kind": "other", "verdict": "proposed"} for a, b in spans
    ]
    labels.write_text(yaml.safe_dump(content))
    completed = check(labels, "-r", path, *(("--manifest", manifest) if exact else ()))
    assert completed.exit_code == 2
    report = [line for line in completed.stdout.splitlines() if "does not lie within" in line]
    for line, place in zip(report, (0, 2, 3), strict=True):
        assert f"intervals.{place}: " in line
        assert "the recording, which runs from " in line
    assert len(lines(completed, labels)) == 3


def test_labels_of_another_recording_are_told(labels: Path, record: RecordingFactory) -> None:
    path = record("field", "mcap", legs=(Leg(3.0, 0.6, 0.0),))
    completed = check(labels, "-r", path)
    assert completed.exit_code == 2
    assert "none of the recordings given is called 'field.bag': found field" in completed.stdout
    own = annotation_path(path)
    own.write_text(f"sha256: {'ab' * 32}\ntime_zero_ns: 0\nrecording: {path.name}\n")
    completed = check(own, "-r", path)
    assert (completed.exit_code, lines(completed, own)) == (2, [1])
    assert "labels of another recording" in completed.stdout


def test_a_recording_that_cannot_be_read_is_a_fault(labels: Path) -> None:
    (labels.parent / "field.bag").write_bytes(b"no bag")
    completed = check(labels, "-r", labels.parent / "field.bag")
    assert completed.exit_code == 2
    assert "its recording cannot be read: " in completed.stdout


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["start_s", "stop_s", "kind", "verdict", "reviewer", "intervals", "x"])
            | st.text(max_size=4),
            inner,
            max_size=5,
        )
    ),
    max_leaves=12,
)


@given(VALUES, VALUES)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_whatever_a_file_says_it_is_sound_just_where_a_build_reads_it(
    labels: Path, whole: object, intervals: object
) -> None:
    for content in (whole, {"time_zero_ns": 5, "reviewer": "Ann", "intervals": intervals}):
        labels.write_text(yaml.safe_dump(content, allow_unicode=True), encoding="utf-8")
        found = check_labels_file(labels)
        try:
            read_annotation(labels)
        except GraspeError:
            assert found.faults
        else:
            report = [fault.text for fault in found.faults]
            assert all("before the one above" in text or "overlaps" in text for text in report)
