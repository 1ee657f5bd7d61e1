"""The labels file: what is written is read, and what is wrong is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from graspe_data.errors import ManifestError, ObservationError
from graspe_data.observation.labels.annotations import (
    annotation_path,
    draft_annotation,
    read_annotation,
    redraft_annotation,
    write_annotation,
)
from graspe_data.observation.labels.events import Event
from graspe_data.observation.labels.proposals import Proposals
from graspe_data.observation.labels.review import decide
from graspe_data.observation.labels.verdicts import Annotation, Interval

ZERO = 1_700_000_000_123_456_789
DIGEST = "0123456789abcdef" * 4

EXAMPLE = f"""\
recording: field.bag
sha256: {DIGEST}
time_zero_ns: {ZERO}
reviewer: Ann
intervals:
- {{start_s: 1.5, stop_s: 3, kind: stuck, verdict: confirmed, note: tall grass}}
- {{start_s: 8.0, stop_s: 8.0, kind: collision, verdict: rejected, reviewer: Bo}}
"""


def at(kind: str, start: float, stop: float) -> Event:
    return Event(kind, ZERO + round(start * 1e9), ZERO + round(stop * 1e9))  # type: ignore[arg-type]


def saved(folder: Path, text: str) -> Path:
    path = folder / "field.bag.labels.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_file_lies_beside_the_recording(tmp_path: Path) -> None:
    assert annotation_path(tmp_path / "run.bag") == tmp_path / "run.bag.labels.yaml"
    assert annotation_path(tmp_path / "folder") == tmp_path / "folder.labels.yaml"
    inside = tmp_path / "folder" / "inner"
    inside.mkdir(parents=True)
    assert annotation_path(inside / "..") == tmp_path / "folder.labels.yaml"


def test_the_documented_example_is_one(tmp_path: Path) -> None:
    documentation = Path(__file__).parents[4] / "docs" / "labels.md"
    text = documentation.read_text(encoding="utf-8")
    example = text.split("```yaml\n")[1].split("```")[0]
    annotation = read_annotation(saved(tmp_path, example))
    assert [interval.verdict for interval in annotation.intervals] == [
        "confirmed",
        "rejected",
        "added",
        "proposed",
    ]


def test_a_file_written_by_hand_is_read(tmp_path: Path) -> None:
    annotation = read_annotation(saved(tmp_path, EXAMPLE), DIGEST)
    stuck, collision = map(annotation.event, annotation.intervals)
    assert stuck == Event("stuck", ZERO + 1_500_000_000, ZERO + 3_000_000_000, "tall grass")
    assert collision.start_ns == collision.stop_ns == ZERO + 8_000_000_000


def test_what_is_written_is_read(tmp_path: Path) -> None:
    proposals = Proposals((at("stuck", 1, 2), at("other", 3, 4)), {"stumble": "no IMU: none"})
    draft = draft_annotation(proposals, "größe.bag", DIGEST, ZERO)
    path = tmp_path / "a.labels.yaml"
    write_annotation(path, draft)
    assert read_annotation(path, DIGEST) == draft
    assert path.read_text(encoding="utf-8").startswith("# Failures in one recording.")
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ManifestError, match="cannot be written"):
        write_annotation(tmp_path / "absent" / "a.yaml", Annotation(time_zero_ns=0))


@pytest.mark.parametrize(
    ("find", "put", "message"),
    [
        ("kind: stuck", "kind: stuk", r"intervals\.0\.kind: Input should be 'stuck'.*'stuk'"),
        ("stop_s: 3", "stop_s: 1.25", r"intervals\.0: .*stop_s 1.25 is before start_s 1.5"),
        ("verdict: rejected", "verdikt: x", r"verdikt: unknown key. Did you mean 'verdict'\?"),
        ("reviewer: Ann", "reviewr: Ann", r"reviewr: unknown key. Did you mean 'reviewer'\?"),
        ("reviewer: Ann\n", "", r"intervals\.0: confirmed, but by whom\?"),
        ("stop_s: 3", "stop_s: .nan", r"intervals\.0\.stop_s: .*finite"),
        ("start_s: 1.5", "start_s: -1.0e+300", r"intervals\.0\.start_s: .*greater than"),
        (f"time_zero_ns: {ZERO}\n", "", "time_zero_ns: Field required"),
        (DIGEST, "abc", "sha256: String should match"),
        ("intervals:", "intervals: [", "not valid YAML"),
        (EXAMPLE, "- 1", "expected a mapping at the top, found list"),
        (EXAMPLE, "!!python/object/apply:os.getcwd []", "not valid YAML"),
    ],
)
def test_faults_are_named(tmp_path: Path, find: str, put: str, message: str) -> None:
    path = saved(tmp_path, EXAMPLE.replace(find, put))
    with pytest.raises(ManifestError, match=message) as caught:
        read_annotation(path)
    assert str(path) in str(caught.value)


def test_labels_of_another_recording_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ManifestError, match="labels of another recording"):
        read_annotation(saved(tmp_path, EXAMPLE), "f" * 64)


class TestDecide:
    proposals = Proposals((at("stuck", 1, 2), at("collision", 5, 6), at("stuck", 9, 10)), {})

    def annotation(self, *intervals: tuple[str, float, float, str]) -> Annotation:
        return Annotation(
            time_zero_ns=ZERO,
            reviewer="Ann",
            intervals=tuple(
                Interval.model_validate(
                    {"kind": kind, "start_s": start, "stop_s": stop, "verdict": verdict}
                )
                for kind, start, stop, verdict in intervals
            ),
        )

    def test_a_persons_verdicts_replace_the_proposals_they_overlap(self) -> None:
        annotation = self.annotation(
            ("stuck", 1.5, 3, "confirmed"),
            ("collision", 5, 5.1, "rejected"),
            ("other", 7, 8, "added"),
        )
        decided = decide(self.proposals, annotation, "take")
        assert decided.by_person == (at("stuck", 1.5, 3), at("other", 7, 8))
        assert decided.taken == (at("stuck", 9, 10),)
        assert decided.counts == {
            "confirmed": 1,
            "added": 1,
            "rejected": 1,
            "taken": 1,
            "left_out": 0,
            "stale": 0,
        }

    def test_another_kind_decides_nothing(self) -> None:
        decided = decide(
            self.proposals, self.annotation(("stumble", 1, 2, "rejected")), "leave_out"
        )
        assert decided.left_out == self.proposals.events
        assert decided.taken == ()

    def test_without_a_file_everything_is_unreviewed(self) -> None:
        assert decide(self.proposals, None, "take").taken == self.proposals.events

    def test_unreviewed_proposals_can_fail_the_build(self) -> None:
        annotation = self.annotation(("stuck", 1, 2, "proposed"), ("collision", 5, 6, "rejected"))
        with pytest.raises(ObservationError, match=r"2 proposed failures .*stuck 1\.00 to 2\.00 s"):
            decide(self.proposals, annotation, "fail")
        assert decide(Proposals((), {}), None, "fail").counts["taken"] == 0

    def test_what_is_no_longer_proposed_labels_nothing_and_is_counted(self) -> None:
        decided = decide(Proposals((), {}), self.annotation(("stuck", 1, 2, "proposed")), "take")
        assert decided.stale == (at("stuck", 1, 2),)
        assert decided.taken == decided.by_person == ()

    def test_a_draft_of_point_events_reviews_them_when_confirmed(self) -> None:
        point = Event("collision", ZERO + 1_234_567_891, ZERO + 1_234_567_891)
        draft = draft_annotation(Proposals((point,), {}), "a", None, ZERO)
        (interval,) = draft.intervals
        assert (interval.start_s, interval.stop_s) == (1.234, 1.235)
        agreed = draft.model_copy(
            update={"intervals": (interval.model_copy(update={"verdict": "confirmed"}),)}
        )
        assert decide(Proposals((point,), {}), agreed, "fail").counts["confirmed"] == 1

    def test_drafting_again_keeps_verdicts_and_asks_only_what_is_open(self) -> None:
        earlier = self.annotation(("stuck", 1, 2, "rejected"), ("stumble", 3, 4, "proposed"))
        again = redraft_annotation(earlier, self.proposals)
        assert [(i.kind, i.verdict) for i in again.intervals] == [
            ("stuck", "rejected"),
            ("collision", "proposed"),
            ("stuck", "proposed"),
        ]
        assert redraft_annotation(again, self.proposals) == again
