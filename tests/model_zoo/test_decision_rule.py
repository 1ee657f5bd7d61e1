from __future__ import annotations

import numpy as np
import pytest

from model_zoo.decision_rule import FailureAlarm, decision_weights


def test_the_published_weights() -> None:
    weights = decision_weights(10)
    published = [0.1246, 0.1184, 0.1125, 0.1068, 0.1015, 0.0964, 0.0916, 0.0870, 0.0827, 0.0785]
    assert weights.sum() == pytest.approx(1)
    assert weights == pytest.approx(published, abs=5e-5)


def test_the_alarm_needs_three_cycles_in_a_row() -> None:
    bad, good = np.zeros(10), np.ones(10)
    alarm = FailureAlarm(10)
    seen = [alarm.update(cycle) for cycle in (bad, bad, good, bad, bad, bad, bad, good)]
    assert seen == [False, False, False, False, False, True, True, False]


def test_clearing_forgets_the_cycles_seen() -> None:
    alarm = FailureAlarm(2)
    for _ in range(2):
        alarm.update(np.zeros(2))
    alarm.clear()
    assert not alarm.update(np.zeros(2))


def test_early_steps_decide_sooner_than_late_ones() -> None:
    alarm = FailureAlarm(10, cycles=1)
    early = np.arange(10) >= 5
    assert alarm.update(early.astype(np.float64))
    assert not alarm.update(1.0 - early)
