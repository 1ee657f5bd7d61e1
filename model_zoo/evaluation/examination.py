"""The examination: what was asked before any test row was read, and what the figures answer.

A cell of the factorial table is a scenario, by the sensor that its hazards need, under a condition,
by the sensor that fails in it. All figures are AU-ROC on rows not failing yet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from graspe_data.errors import ManifestError, ZooError
from graspe_data.manifest import Settings, Share, find_manifest, load_manifest
from model_zoo.augmentation import FAILING_SENSOR, Condition
from model_zoo.evaluation.blind_references import difference
from model_zoo.evaluation.cell import Score
from model_zoo.evaluation.contestants import Contestant
from model_zoo.evaluation.entrants import UNDEFINED
from model_zoo.evaluation.parts import NOT_FAILING

Sensor = Literal["camera", "lidar"]
Need = Literal["camera", "lidar", "either", "both"]
Verdict = Literal["shown", "not shown", "undecided", "missing"]


class Margins(Settings):
    """Differences of AU-ROC that count.

    Attributes:
        lead: Of the best model over the best blind reference.
        need: Lost with a strange sensor where the scenario needs it.
        gain: Of a challenger over the control where one sensor fails and the other suffices.
        harm: What a challenger may lose to the control where all is sound.
    """

    lead: Share
    need: Share
    gain: Share
    harm: Share


class Examination(Settings):
    """A file of ``manifests/examinations``.

    Attributes:
        needs: Which sensor tells the hazards of a scenario in time.
        by_day: Scenarios in which the lead is asked for.
        taught: Conditions of a kind that training shows; all others are never taught.
        sound: The condition in which nothing fails.
        strange: The condition in which a sensor shows another scene.
        control: The model that takes all sensors as reliable.
        challengers: Models that weigh sensors.
        margins: What counts.
    """

    name: str
    needs: Annotated[Mapping[str, Need], Field(min_length=1)]
    by_day: tuple[str, ...]
    taught: tuple[Condition, ...]
    sound: Condition = "clean"
    strange: Mapping[Sensor, Condition]
    control: str
    challengers: tuple[str, ...]
    margins: Margins

    def suffices(self, scenario: str, failing: Sensor) -> bool:
        """Whether the other sensor tells the hazards of a scenario when one fails."""
        need = self.needs.get(scenario)
        return need == "either" or (need is not None and need not in (failing, "both"))


def load_examination(name: str | Path) -> Examination:
    """An examination by path, or by the name of one that ships.

    Raises:
        ZooError: There is none, or it does not validate.
    """
    try:
        return load_manifest(find_manifest("examinations", name), Examination)
    except ManifestError as error:
        raise ZooError(str(error)) from error


@dataclass(frozen=True)
class Answer:
    """One question in one place, or over several of them.

    Attributes:
        question: Which margin it is held against.
        what: The place, in words.
        model: Who is asked.
        score: The difference, with its interval.
        verdict: ``shown``: the margin is met, and the interval decides; ``not shown``: it is not;
            ``undecided``: the value meets it and the interval does not decide.
    """

    question: Literal["lead", "need", "gain", "harm"]
    what: str
    model: str
    score: Score
    verdict: Verdict


def examine(models: Sequence[Contestant], asked: Examination) -> list[Answer]:
    """Hold the evaluations of models against what was asked of them.

    Args:
        models: Of those that share a name the first is the control or the challenger.
        asked: The questions.

    Raises:
        ZooError: The control is not among the models.
    """
    by_name: dict[str, Contestant] = {}
    for model in models:
        by_name.setdefault(model.runs[0].model, model)
    if asked.control not in by_name:
        raise ZooError(
            f"examination {asked.name}: the control {asked.control} is not among the models "
            f"({', '.join(by_name)}). Evaluate it too."
        )
    control = by_name[asked.control]
    challengers = [by_name[name] for name in asked.challengers if name in by_name]
    return [
        *_leads(models, asked),
        *_needs(models, asked),
        *(a for each in challengers for a in _gains(each, control, asked)),
        *(a for each in challengers for a in _harms(each, control, asked)),
    ]


def _leads(models: Sequence[Contestant], asked: Examination) -> Iterator[Answer]:
    """The best model's lead over the best blind reference, scenario by scenario."""
    first = models[0].runs[0]
    for scenario in asked.by_day:
        best = max(models, key=lambda m: m.au_roc(scenario, asked.sound).value or 0.0)
        lead = best.lead(first.references, scenario, asked.sound)
        score = UNDEFINED if lead is None else Score(**lead.model_dump(exclude={"reference"}))
        verdict = _at_least(score, asked.margins.lead)
        yield Answer("lead", scenario, best.label, score, verdict)


def _needs(models: Sequence[Contestant], asked: Examination) -> Iterator[Answer]:
    """What the best model loses with a strange sensor where the scenario needs it."""
    for scenario, need in asked.needs.items():
        if need not in ("camera", "lidar") or need not in asked.strange:
            continue
        best = max(models, key=lambda m: m.au_roc(scenario, asked.sound).value or 0.0)
        score = best.decline(asked.sound, asked.strange[need], scenario)
        verdict = _at_least(score, asked.margins.need)
        yield Answer("need", f"{scenario}, strange {need}", best.label, score, verdict)


def _gains(model: Contestant, control: Contestant, asked: Examination) -> Iterator[Answer]:
    """What weighing brings where one sensor fails and the other suffices, taught kinds apart."""
    for failing in asked.strange:
        scenarios = [name for name in asked.needs if asked.suffices(name, failing)]
        for taught in (True, False):
            conditions = _conditions(model, asked, failing, taught=taught)
            places = [(s, c) for s in scenarios for c in conditions]
            kind = "taught" if taught else "never taught"
            score = mean_advantage(model, control, places)
            verdict = _at_least(score, asked.margins.gain)
            what = f"{failing} fails, {kind}: {', '.join(conditions) or 'none'}"
            yield Answer("gain", what, model.label, score, verdict)


def _harms(model: Contestant, control: Contestant, asked: Examination) -> Iterator[Answer]:
    places = [(scenario, asked.sound) for scenario in model.runs[0].scenarios]
    score = mean_advantage(model, control, places)
    if score.value is None:
        verdict: Verdict = "missing"
    elif score.value < -asked.margins.harm:
        verdict = "not shown"
    else:
        low = score.low
        verdict = "shown" if low is not None and low >= -asked.margins.harm else "undecided"
    yield Answer("harm", "all is sound, mean over scenarios", model.label, score, verdict)


def mean_advantage(
    model: Contestant, control: Contestant, places: Sequence[tuple[str, str]]
) -> Score:
    """The mean over places of AU-ROC less the control's, on the same resamples."""
    pairs = [
        (entrant.au_roc(*place).value, entrant.resampled(*place, NOT_FAILING))
        for place in places
        for entrant in (model, control)
    ]
    if not pairs or any(value is None for value, _ in pairs):
        return UNDEFINED
    if len({resamples.size for _, resamples in pairs}) > 1:
        return UNDEFINED
    values = np.array([value for value, _ in pairs], float).reshape(-1, 2).mean(axis=0)
    drawn = np.array([resamples for _, resamples in pairs]).reshape(len(places), 2, -1)
    mine, theirs = drawn.mean(axis=0)
    return difference((float(values[0]), mine), (float(values[1]), theirs))


def _conditions(
    model: Contestant, asked: Examination, failing: Sensor, *, taught: bool
) -> list[str]:
    """The conditions evaluated in which a sensor fails, of a kind that is taught or not."""
    strange = set(asked.strange.values())
    return [
        name
        for name, sensor in FAILING_SENSOR.items()
        if sensor == failing
        and name not in strange
        and (name in asked.taught) == taught
        and name in model.runs[0].conditions
    ]


def _at_least(score: Score, margin: float) -> Verdict:
    """Whether a difference meets a margin, and its interval lies above 0."""
    if score.value is None:
        return "missing"
    if score.value < margin:
        return "not shown"
    return "shown" if score.low is not None and score.low > 0 else "undecided"
