"""Labels files held against their form and against the recordings that they are of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from graspe_data.errors import GraspeError, ManifestError
from graspe_data.observation.labels import annotation_path
from graspe_data.observation.labels.faults import CheckedLabels, check_labels, outside
from graspe_data.recordings import open_recording, recording_digest
from graspe_data.synchronisation.synchronised import synchronise
from graspe_data.yaml_lines import LinedFault, LinedYaml, read_lined_yaml
from pipelines.dataset_settings import DatasetRecipe

SUFFIX = ".labels.yaml"
SHOWN = 5


@dataclass(frozen=True)
class LabelCheck:
    """What is wrong with a labels file, in the order of its lines; and how many verdicts it has.

    ``recording`` is the one it was held against, None where none was given or fits.
    """

    path: Path
    faults: tuple[LinedFault, ...]
    verdicts: dict[str, int]
    recording: Path | None = None


def find_labels(path: Path) -> list[Path]:
    """A labels file, or all of them below a folder.

    Raises:
        ManifestError: Nothing there.
    """
    if not path.is_dir():
        return [path]
    found = sorted(file for file in path.rglob(f"*{SUFFIX}") if file.is_file())
    if not found:
        raise ManifestError(
            f"{path}: no labels file here or below: expected names that end in {SUFFIX}, as "
            f"`graspe label propose` writes them."
        )
    return found


def check_labels_file(
    path: Path, recordings: Sequence[Path] = (), recipe: DatasetRecipe | None = None
) -> LabelCheck:
    """Find every fault of a labels file.

    Args:
        path: The file.
        recordings: Among which its recording is; none leaves that out.
        recipe: With it, ends are held against the odometry on the dataset's clock, as a build
            does; without, against the stamps of all topics.

    Raises:
        ManifestError: The file is missing, too large, or not UTF-8.
    """
    document = read_lined_yaml(path)
    checked = check_labels(document)
    faults = [*checked.faults, *_names(path, document)]
    recording = _recording_of(path, document, recordings) if recordings else None
    if recording is not None:
        faults += _against(document, checked, recording, recipe)
    elif recordings:
        faults.append(_unknown(path, recordings))
    verdicts = (
        [interval.verdict for interval in checked.annotation.intervals]
        if (checked.annotation)
        else []
    )
    return LabelCheck(path, tuple(sorted(faults)), dict(Counter(verdicts)), recording)


def _names(path: Path, document: LinedYaml) -> Iterator[LinedFault]:
    """The file's name, and that of the recording in it, which have to fit each other."""
    if not path.name.endswith(SUFFIX) or path.name == SUFFIX:
        yield LinedFault(
            0,
            f"the name of the file: expected that of the recording with {SUFFIX} after it, or no "
            f"build finds it.",
        )
        return
    said = _text_of(document, "recording")
    if said and said != path.name.removesuffix(SUFFIX):
        yield LinedFault(
            document.line(("recording",)),
            f"recording: {said!r}, but the file is named for {path.name.removesuffix(SUFFIX)!r}. "
            f"Rename the file, or mend the key.",
        )


def _text_of(document: LinedYaml, key: str) -> str:
    content = document.content
    value = content.get(key) if isinstance(content, dict) else None
    return value if isinstance(value, str) else ""


def _recording_of(path: Path, document: LinedYaml, recordings: Sequence[Path]) -> Path | None:
    """The recording beside the file, else the one it is named for, else the one it names."""
    name = _text_of(document, "recording")
    beside = [
        recording_path
        for recording_path in recordings
        if annotation_path(recording_path).resolve() == path.resolve()
    ]
    alike = [
        recording_path
        for recording_path in recordings
        if annotation_path(recording_path).name == path.name
    ]
    by_name = [
        recording_path
        for recording_path in recordings
        if name and recording_path.resolve().name == name
    ]
    return next(iter([*beside, *alike, *by_name]), None)


def _unknown(path: Path, recordings: Sequence[Path]) -> LinedFault:
    names = [recording_path.resolve().name for recording_path in recordings]
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return LinedFault(
        0,
        f"none of the recordings given is called {path.name.removesuffix(SUFFIX)!r}: found "
        f"{', '.join(names[:SHOWN])}{more}.",
    )


def _against(
    document: LinedYaml, checked: CheckedLabels, recording: Path, recipe: DatasetRecipe | None
) -> Iterator[LinedFault]:
    """Whether the file is of this recording, and its intervals lie within."""
    try:
        declared, digest = _text_of(document, "sha256"), recording_digest(recording)
        if checked.annotation and declared and declared != digest:
            yield LinedFault(
                document.line(("sha256",)),
                f"sha256: labels of another recording: expected {declared}, {recording.name} has "
                f"{digest}.",
            )
        span = _stamps(recording) if recipe is None else _odometry(recording, recipe)
    except GraspeError as error:
        yield LinedFault(0, f"its recording cannot be read: {error}")
        return
    yield from outside(document, checked, *span)


def _odometry(path: Path, recipe: DatasetRecipe) -> tuple[int, int]:
    """First and last stamp of the odometry, ns, as the build has it."""
    recipe = recipe.for_recording(path.name)
    dataset = recipe.dataset
    with open_recording(path) as recording:
        found = synchronise(recording, recipe.robot, dataset.clocks, dataset.synchronisation)
    return int(found.odometry.stamps_ns[0]), int(found.odometry.stamps_ns[-1])


def _stamps(path: Path) -> tuple[int, int]:
    """First and last stamp of all topics whose stamps go on, ns; bag times where none has any."""
    bag: list[int] = []
    spans: dict[str, list[int]] = {}
    with open_recording(path) as recording:
        for raw in recording.messages():
            bag = _wider(bag, raw.bag_time_ns)
            if stamp := recording.header_stamp_ns(raw):
                spans[raw.topic] = _wider(spans.get(raw.topic, []), stamp)
    going = [span for span in spans.values() if span[0] < span[1]] or [bag or [0, 0]]
    return min(span[0] for span in going), max(span[1] for span in going)


def _wider(span: list[int], stamp: int) -> list[int]:
    return [min(stamp, *span), max(stamp, *span)] if span else [stamp, stamp]
