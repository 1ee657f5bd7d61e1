"""What an evaluation found, how its checkpoint was trained, and the file it goes to."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from stat import S_ISREG
from tempfile import TemporaryFile
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from graspe_data.atomic_file import write_atomically
from graspe_data.documents import Sha256, canonical_json, parse_document
from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.augmentation import CONDITIONS, KNOWN_CONDITIONS
from model_zoo.evaluation.blind_references import References
from model_zoo.evaluation.cell import ALL_SCENARIOS, Cell, Count
from model_zoo.evaluation.latency import LARGEST_COUNT, Latency

_SHORT = 8

Value = bool | int | float | str | None


_OF_NO_WEIGHT = ("seed", "searched")
"""What does not make another recipe."""


class RecipeSummary(Settings):
    """A recipe without its seed, and without how it was found.

    Attributes:
        digest: SHA-256 of all its values.
        values: Its values; of a group of values the beginning of the group's digest.
    """

    digest: Sha256
    values: Mapping[str, Value]

    @property
    def short(self) -> str:
        """The beginning of the digest, for people."""
        return self.digest[:_SHORT]


def summarise_recipe(recipe: Any) -> RecipeSummary | None:
    """The summary of a checkpoint's recipe; None where that is no mapping of plain values."""
    if not isinstance(recipe, Mapping):
        return None
    content = {str(name): value for name, value in recipe.items() if name not in _OF_NO_WEIGHT}
    try:
        values = {name: _value(value) for name, value in content.items()}
        return RecipeSummary(digest=digest_of(content), values=values)
    except (ValueError, TypeError):
        return None


def _value(value: Any) -> Value:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    return digest_of({"value": value})[:_SHORT]


def digest_of(content: Mapping[str, Any]) -> str:
    """SHA-256 of values that JSON has, whatever their order."""
    return hashlib.sha256(canonical_json(content).encode()).hexdigest()


_LARGEST = 256 << 20


class Evaluation(Settings):
    """Scores of one checkpoint on one split.

    Attributes:
        format: Version of the file.
        model: Name of the model.
        preset: Its preset.
        seed: Of the training, where the recipe has one.
        recipe: The rest of it; None where it is not known.
        steps: That the training did; None where it is not known.
        searched: Trainings that chose its settings on validation; None where it is not said.
        ranks: Processes that shared a step; None where it is not known.
        parameters: Numbers in the model.
        settings: Digest of the model's settings; None where they are not known.
        checkpoint: Digest of the checkpoint.
        trained_on: Digest of the dataset it was trained on.
        dataset: Digest of the dataset of this evaluation.
        split: The split.
        temperature: Of the calibration; None where there is none.
        resamples: Of recordings, for the intervals.
        resample_seed: Seed of the resamples and of the degradations.
        every: Of the judged rows of a recording, every so many were taken.
        references: What is known without a sensor; no evaluation is without them.
        cells: Every scenario and all together, under every condition.
        latency: Of one prediction.
    """

    format: Literal["graspe-evaluation-2"] = "graspe-evaluation-2"
    model: str
    preset: str
    seed: int | None
    recipe: RecipeSummary | None = None
    steps: Annotated[int, Field(ge=0)] | None = None
    searched: Annotated[int, Field(ge=1)] | None = None
    ranks: Annotated[int, Field(ge=1)] | None = None
    parameters: Annotated[int, Field(ge=0, le=LARGEST_COUNT)]
    settings: Sha256 | None = None
    checkpoint: Sha256
    trained_on: Sha256
    dataset: Sha256
    split: str
    temperature: float | None
    resamples: Count
    resample_seed: int
    every: Count = 1
    references: References
    cells: tuple[Cell, ...]
    latency: Latency

    @model_validator(mode="after")
    def _check_cells(self) -> Self:
        places = [(cell.scenario, cell.condition) for cell in self.cells]
        wanted = {(s, c) for s in (ALL_SCENARIOS, *self.scenarios) for c in self.conditions}
        if not places or set(places) != wanted or len(set(places)) < len(places):
            raise ValueError(
                f"cells: found {len(places)}, expected one for every scenario, and for "
                f"{ALL_SCENARIOS!r}, under every condition"
            )
        for cell in self.cells:
            for name, part in cell.parts.items():
                self._check_resamples(name, len(part.resamples), cell)
        return self

    def _check_resamples(self, name: str, drawn: int, cell: Cell) -> None:
        if drawn not in (0, self.resamples):
            raise ValueError(
                f"resamples of {name} of {cell.scenario!r} under {cell.condition!r}: found "
                f"{drawn}, expected {self.resamples} or none"
            )

    def cell(self, scenario: str = ALL_SCENARIOS, condition: str = "clean") -> Cell | None:
        """The cell of a scenario and a condition; None where there is none."""
        found = (c for c in self.cells if (c.scenario, c.condition) == (scenario, condition))
        return next(found, None)

    @property
    def scenarios(self) -> tuple[str, ...]:
        """The scenarios, without ``all``, in order."""
        names = dict.fromkeys(cell.scenario for cell in self.cells)
        return tuple(name for name in names if name != ALL_SCENARIOS)

    @property
    def conditions(self) -> tuple[str, ...]:
        """The conditions, in order."""
        return tuple(dict.fromkeys(cell.condition for cell in self.cells))

    def write(self, path: Path) -> None:
        """Write it as JSON, atomically.

        Raises:
            ZooError: The file cannot be written.
        """
        text = canonical_json(self.model_dump(mode="json"), indent=None) + "\n"
        write_atomically(path, [text.encode()], ZooError)


def read_evaluation(path: Path) -> Evaluation:
    """Read the file of an evaluation.

    Raises:
        ZooError: It is missing, not JSON, or no evaluation; each fault with its key.
    """
    try:
        found = path.stat()
        if not S_ISREG(found.st_mode):
            raise ZooError(f"{path}: no regular file; give the file that `zoo evaluate` wrote.")
        if found.st_size > _LARGEST:
            raise ZooError(f"{path}: larger than {_LARGEST} bytes, so no evaluation.")
        content = path.read_bytes()
    except OSError as error:
        raise ZooError(
            f"{path}: cannot be read: {error.strerror}. Run `graspe zoo evaluate` first."
        ) from error
    return parse_document(content, Evaluation, path, ZooError, "Evaluate again.")


_USUAL_SPLIT = "test"


def evaluation_name(split: str, conditions: Sequence[str], every: int) -> str:
    """``evaluation.json`` for all rows of ``test`` under all conditions; else names what is not so.

    A quick evaluation so never takes the place of a fuller one.
    """
    parts = ["evaluation"]
    if split != _USUAL_SPLIT:
        parts.append(split.replace("/", "_"))
    if tuple(conditions) == KNOWN_CONDITIONS:
        parts.append("all_conditions")
    elif tuple(conditions) != CONDITIONS:
        parts += conditions
    if every > 1:
        parts.append(f"every_{every}")
    return "-".join(parts) + ".json"


def check_writable(file: Path) -> None:
    """Refuse, before any work is done, a file that could not be written after it.

    Raises:
        ZooError: Something other than a regular file is there, or its folder cannot be written.
    """
    if file.exists() and not file.is_file():
        kind = "a folder" if file.is_dir() else "no regular file"
        raise ZooError(f"{file}: is {kind}; expected the path of a file. Give another with --out.")
    try:
        with TemporaryFile(dir=file.parent):
            pass
    except OSError as error:
        raise ZooError(
            f"{file}: cannot be written: {error.strerror}. Make its folder, let it be written, or "
            "give another with --out."
        ) from error
