"""Trials read back from their files, and counted by method and scenario."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from graspe_data.errors import StageError
from pipelines.trials.trial import Trial, read_trial

WILSON_Z = 1.959964
"""Of 95 %."""


@dataclass(frozen=True)
class TrialGroup:
    """The trials of one method in one scenario, or of one method in several."""

    method: str
    scenario: str
    trials: tuple[Trial, ...]

    @property
    def successes(self) -> int:
        """How many arrived."""
        return sum(trial.success for trial in self.trials)

    @property
    def rate(self) -> float:
        """Share that arrived."""
        return self.successes / len(self.trials)

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the rate."""
        return wilson_interval(self.successes, len(self.trials))

    @property
    def normalised_length(self) -> float | None:
        """Mean over the successes; None where there is none."""
        return _mean([trial.normalised_length for trial in self.trials if trial.success])

    @property
    def length_of_all(self) -> float | None:
        """Mean over all trials, as both papers have it: a short way may be an early failure."""
        return _mean([trial.normalised_length for trial in self.trials])

    @property
    def duration_s(self) -> float | None:
        """Mean over the successes, simulated seconds."""
        return _mean([trial.duration_s for trial in self.trials if trial.success])

    @property
    def collisions(self) -> float:
        """Mean a trial."""
        return sum(trial.collisions for trial in self.trials) / len(self.trials)

    @property
    def outcomes(self) -> Counter[str]:
        """Trials by how they ended."""
        return Counter(trial.outcome for trial in self.trials)

    @property
    def failures(self) -> Counter[str]:
        """Failed trials by why."""
        return Counter(trial.failure.kind for trial in self.trials if trial.failure)

    @property
    def free_share(self) -> float | None:
        """Share of the commands to move on whose arcs get through the world."""
        arcs = sum(trial.arcs for trial in self.trials)
        return sum(trial.arcs_free for trial in self.trials) / arcs if arcs else None

    @property
    def map_shares(self) -> tuple[float | None, float | None, float | None]:
        """Precision, recall and F-score of the maps: means over the trials that have them."""
        scores = [trial.maps for trial in self.trials if trial.maps]
        columns = zip(*((s.precision, s.recall, s.f_score) for s in scores), strict=True)
        precision, recall, f_score = list(columns) or [(), (), ()]
        return _known_mean(precision), _known_mean(recall), _known_mean(f_score)

    @property
    def map_ms(self) -> float | None:
        """Milliseconds of a map: mean of the trials' medians; None without maps."""
        return _mean([trial.maps.median_ms for trial in self.trials if trial.maps])

    @property
    def answer_s(self) -> tuple[float, float]:
        """Seconds of an answer: median over trials of their medians, and of their 90 %."""
        times = [(trial.control.median_s, trial.control.p90_s) for trial in self.trials]
        median, late = np.median(np.array(times), axis=0).tolist()
        return median, late


def read_trials(out: Path) -> list[Trial]:
    """Read all trials of a folder of `graspe navigate run`.

    Raises:
        StageError: There is none, a file is damaged or not where its trial belongs, the trials of
            a scenario were not run under the same conditions, or those of a method not by the same
            bundle and settings.
    """
    paths = sorted(out.glob("*/*/*.json"))
    trials = [read_trial(path) for path in paths]
    if not trials:
        raise StageError(f"{out}: no trials there; `graspe navigate run SCENARIO --out {out}`.")
    _check_comparable(out, paths, trials)
    return trials


def _check_comparable(out: Path, paths: Sequence[Path], trials: Sequence[Trial]) -> None:
    first: dict[tuple[str, str], tuple[str, Path]] = {}
    for path, trial in zip(paths, trials, strict=True):
        belongs = Path(trial.scenario, trial.method, f"{trial.seed}.json")
        if path.relative_to(out) != belongs:
            raise StageError(
                f"{path}: holds the trial {belongs}, which would count twice. Move it there, or "
                "remove it."
            )
        for shared, name, digest in (
            ("other conditions (scenario, robot or settings)", trial.scenario, trial.conditions),
            ("another bundle or other settings of the method", trial.method, trial.driver),
        ):
            known, other = first.setdefault((shared, name), (digest, path))
            if digest != known:
                raise StageError(
                    f"{path} and {other} were run under {shared}: they are not to be compared. "
                    "Remove one and run it again."
                )


def cells(trials: Sequence[Trial], methods: Sequence[str] = ()) -> list[TrialGroup]:
    """Count by method and scenario; methods in the order asked for, all by name for none.

    Raises:
        StageError: A method has no trial.
    """
    there = sorted({trial.method for trial in trials})
    missing = [method for method in methods if method not in there]
    if missing:
        raise StageError(
            f"no trials of {', '.join(missing)}; there are those of {', '.join(there)}"
        )
    scenarios = sorted({trial.scenario for trial in trials})
    groups = [
        TrialGroup(method, scenario, _of(trials, method, scenario))
        for method in dict.fromkeys(methods or there)
        for scenario in scenarios
    ]
    return [cell for cell in groups if cell.trials]


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share by Wilson (1927), which holds for few trials too."""
    share, z2 = successes / trials, WILSON_Z**2
    middle = (share + z2 / (2 * trials)) / (1 + z2 / trials)
    spread = np.sqrt(share * (1 - share) / trials + z2 / (4 * trials**2))
    half = WILSON_Z * float(spread) / (1 + z2 / trials)
    return max(0.0, middle - half), min(1.0, middle + half)


def _of(trials: Sequence[Trial], method: str, scenario: str) -> tuple[Trial, ...]:
    return tuple(t for t in trials if t.method == method and t.scenario == scenario)


def _known_mean(values: Sequence[float | None]) -> float | None:
    return _mean([value for value in values if value is not None])


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
