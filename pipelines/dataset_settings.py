"""The dataset manifest: every knob between recordings and shards, with its default."""

from __future__ import annotations

import fnmatch
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from graspe_data.columns import Codec
from graspe_data.errors import ManifestError
from graspe_data.manifest import (
    Settings,
    Share,
    find_manifest,
    load_manifest,
    read_yaml,
    shipped_manifests,
)
from graspe_data.observation.intensity_map import LayerSettings, ReturnSettings
from graspe_data.observation.labels import LabelSettings, ProposalSettings, Unreviewed
from graspe_data.observation.settings import ObservationManifest, ObservationSettings
from graspe_data.robot import Clock, Clocks, Robot, load_robot
from graspe_data.synchronisation.clocks import ClockSettings
from graspe_data.synchronisation.row_plan import SynchronisationSettings, WindowSettings

Split = Literal["train", "validation", "test"]
OptionalColumn = Literal["smoothness", "intensity_map"]
Count = Annotated[int, Field(ge=1)]


class LabelRules(Settings):
    """What the labels leave unjudged, and what becomes of proposals that nobody reviewed."""

    maximum_deviation: Annotated[float, Field(gt=0)] = 0.5
    """Metres between the driven path and the predicted arc, at equal times."""
    maximum_gap_s: Annotated[float, Field(gt=0)] = 0.5
    unreviewed: Unreviewed = "take"


class Group(Settings):
    """Recordings that belong together (a day, a place, a world), and their split if declared."""

    name: str
    recordings: tuple[str, ...]
    """Patterns of recording names, as in a shell."""
    split: Split | None = None


class TimeSplit(Settings):
    """For few recordings: blocks of time of one recording go to different splits.

    A model is then examined in places that it was taught in, at other times: a score on such a test
    split says less than one on drives of their own.
    """

    block_s: Annotated[float, Field(gt=0, le=36_000)] = 60.0
    """Seconds of a block."""
    guard_s: Annotated[float, Field(ge=0, le=36_000)] = 10.0
    """Seconds between what rows of two splits look at, at least."""


class SplitSettings(Settings):
    """Splits are by group, never by row; a group without a split draws one from its name."""

    train: Share = 0.8
    validation: Share = 0.1
    test: Share = 0.1
    groups: tuple[Group, ...] = ()
    by_time: TimeSplit | None = None
    """With it, drives that are in no group with a split are split by blocks of time."""

    @model_validator(mode="after")
    def _whole(self) -> Self:
        total = self.train + self.validation + self.test
        if abs(total - 1.0) > 1e-6:  # noqa: PLR2004
            raise ValueError(f"train + validation + test is {total:g}, and must be 1")
        names = [group.name for group in self.groups]
        if repeated := {name for name in names if names.count(name) > 1}:
            raise ValueError(
                f"groups: {', '.join(sorted(repeated))} is declared twice; list all its recordings "
                f"in one group"
            )
        return self

    def group_of(self, recording: str) -> Group | None:
        """The declared group of a recording, by its name."""
        for group in self.groups:
            if any(fnmatch.fnmatchcase(recording, pattern) for pattern in group.recordings):
                return group
        return None


class RecordingClocks(Settings):
    """Clocks of some recordings, where they are not those of the robot's manifest.

    A sensor on its own clock is set anew at every start, so its offset differs from one recording
    to the next. A topic that is not named here keeps the robot's clock.
    """

    recordings: Annotated[tuple[str, ...], Field(min_length=1)]
    """Patterns of recording names, as in a shell."""
    image: Clock | None = None
    points: Clock | None = None
    odometry: Clock | None = None
    command: Clock | None = None
    imu: Clock | None = None

    def over(self, clocks: Clocks) -> Clocks:
        """The robot's clocks with these in their place."""
        named = {name: getattr(self, name) for name in type(clocks).model_fields}
        return clocks.model_copy(update={k: clock for k, clock in named.items() if clock})


class CandidateSettings(Settings):
    """Optional columns: other trajectories than the driven one, and how the world says they end."""

    topic: str = "/truth/candidates"
    """Where a simulated recording says it."""
    count: Annotated[int, Field(ge=1, le=64)] = 8
    """Candidates that a row keeps."""


class StorageSettings(Settings):
    """How rows lie on disk; changes no content."""

    rows_per_shard: Annotated[int, Field(ge=1, le=65_536)] = 256
    image_codec: Literal["raw", "png"] = "raw"
    optional_columns: tuple[OptionalColumn, ...] = ("smoothness",)


class DatasetManifest(ObservationManifest):
    """What a dataset is made of and how. Every field is a knob; the defaults are the paper's."""

    name: str
    robot: str
    """A robot manifest: the name of one that ships, or a path beside this file."""
    seed: int = 0
    window: WindowSettings = WindowSettings()
    intensity_map: LayerSettings = LayerSettings()
    """Of the optional column; ignored without it."""
    candidates: CandidateSettings | None = None
    """Only simulated recordings know them; null leaves the columns out."""
    proposals: ProposalSettings = ProposalSettings()
    labels: LabelRules = LabelRules()
    clocks: ClockSettings = ClockSettings()
    recording_clocks: tuple[RecordingClocks, ...] = ()
    """The first entry that matches a recording's name counts."""
    split: SplitSettings = SplitSettings()
    storage: StorageSettings = StorageSettings()

    @model_validator(mode="after")
    def _blocks_hold_rows(self) -> Self:
        if self.split.by_time is None:
            return self
        guard_s, block_s = self.split.by_time.guard_s, self.split.by_time.block_s
        taken = self.looks_back_s + self.looks_ahead_s + guard_s
        if block_s <= taken:
            raise ValueError(
                f"split.by_time.block_s: a block of {block_s:g} s between two others has no row: "
                f"history, horizon and tolerances take {taken - guard_s:g} s of it and guard_s "
                f"{guard_s:g} s; give more than {taken:g}"
            )
        return self

    @property
    def looks_back_s(self) -> float:
        """Seconds before an anchor that decide its row."""
        history = self.window.history_steps * self.window.history_step_s
        return history + self.window.odometry_gap_s + self.window.points_tolerance_s

    @property
    def looks_ahead_s(self) -> float:
        """Seconds after an anchor that decide its row: the horizon."""
        return self.horizon.steps * self.horizon.step_s + self.window.odometry_gap_s

    @property
    def intensity_layers(self) -> LayerSettings | None:
        """The layers of the column `intensity_map`; None where it is not asked for."""
        return self.intensity_map if "intensity_map" in self.storage.optional_columns else None

    @property
    def synchronisation(self) -> SynchronisationSettings:
        """The window with the horizon's length."""
        length = self.horizon.steps * self.horizon.step_s
        return SynchronisationSettings(**self.window.model_dump(), horizon_s=length)

    @property
    def label_settings(self) -> LabelSettings:
        """The label rules with the horizon."""
        limits = self.labels.model_dump(exclude={"unreviewed"})
        return LabelSettings(**self.horizon.model_dump(), **limits)

    @property
    def image_codec(self) -> Codec:
        """The codec of the image column."""
        return self.storage.image_codec


class DatasetRecipe(Settings):
    """A dataset manifest with its robot resolved: all that the stages need to know."""

    dataset: DatasetManifest
    robot: Robot

    def for_recording(self, name: str) -> DatasetRecipe:
        """The recipe of one recording: the robot with the clocks that it has there."""
        for entry in self.dataset.recording_clocks:
            if any(fnmatch.fnmatchcase(name, pattern) for pattern in entry.recordings):
                robot = self.robot.model_copy(update={"clocks": entry.over(self.robot.clocks)})
                return self.model_copy(update={"robot": robot})
        return self

    @property
    def observation(self) -> ObservationSettings:
        """How the robot's sensors are observed."""
        return self.dataset.on_robot(self.robot)

    @property
    def intensity_returns(self) -> ReturnSettings:
        """What the robot decides of its intensity maps."""
        return ReturnSettings.of(self.robot)


def load_recipe(name: str | Path) -> DatasetRecipe:
    """Load a dataset manifest, by path or by shipped name, and the robot that it names.

    Raises:
        ManifestError: Either manifest is missing or does not validate.
    """
    path = find_manifest("datasets", name)
    content = read_yaml(path)
    if isinstance(content, dict) and "footprint" in content:
        raise ManifestError(
            f"{path}: this is a robot manifest. Give a dataset manifest that names it under "
            f"`robot:`; `{shipped_manifests() / 'datasets' / 'graspe.yaml'}` is one to copy."
        )
    dataset = load_manifest(path, DatasetManifest)
    return DatasetRecipe(dataset=dataset, robot=load_robot(robot_manifest(name)))


def robot_manifest(name: str | Path) -> Path:
    """The path of the robot manifest that a dataset manifest names.

    Raises:
        ManifestError: Either is missing, or the dataset manifest does not validate.
    """
    path = find_manifest("datasets", name)
    dataset = load_manifest(path, DatasetManifest)
    return find_manifest("robots", dataset.robot, beside=path.parent)
