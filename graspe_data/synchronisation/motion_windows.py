"""What twist and poses say of the same second: the windows in which they are compared."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from graspe_data.arrays import Floats
from graspe_data.synchronisation.motion_samples import SECOND, MotionSamples

WINDOW_S: Final = 1.0
CONSTANT: Final = 1e-9
_STANDING_M, _STANDING_RAD = 0.05, 0.1
_CREEPING_M_S, _CREEPING_RAD_S = 0.02, 0.03
"""What a window longer than a second must show besides, by the second."""
_CLEAR_M, _CLEAR_RAD = 0.2, 0.3
_LONGEST_WINDOW_S: Final = 10.0


@dataclass(frozen=True)
class Window:
    """One window: the lengths of the ways (posed, told, body error, fixed error), and turns.

    ``turns`` are posed, told, and the errors of the twist taken as the body's and as fixed;
    ``silent`` tells that not a digit of the twist changed while the poses moved.
    """

    begin_ns: int
    seconds: float
    ways: tuple[float, float, float, float]
    turns: tuple[float, float, float, float]
    silent: bool


def moves(window: Window) -> bool:
    """Whether either source moves by more than noise."""
    return max(window.ways[:2]) > _STANDING_M + _CREEPING_M_S * (window.seconds - WINDOW_S)


def turns(window: Window) -> bool:
    """Whether either source turns by more than noise."""
    slow = _CREEPING_RAD_S * (window.seconds - WINDOW_S)
    return max(window.turns[:2]) > _STANDING_RAD + slow


def led_astray(window: Window) -> bool:
    """Whether twist and poses differ by more than half of the way, in whichever frame."""
    way = max(window.ways[:2])
    return way > _CLEAR_M and min(window.ways[2:]) > 0.5 * way


def turned_astray(window: Window) -> bool:
    """Whether they differ by more than half of the turn, in whichever frame."""
    turn = max(window.turns[:2])
    return turn > _CLEAR_RAD and min(window.turns[2:]) > 0.5 * turn


@dataclass(frozen=True)
class Sums:
    """Poses and the integrals of the twist over one piece of a series, (N, ...)."""

    samples: MotionSamples
    position: Floats
    turned: Floats
    by_body: Floats
    by_fixed: Floats
    turned_by_body: Floats
    turned_by_fixed: Floats

    @classmethod
    def of(cls, samples: MotionSamples, up: Floats) -> Sums:
        """The integrals of a piece whose samples follow one another."""
        seconds = (samples.stamps_ns - samples.stamps_ns[0]) / SECOND
        # The twist read as the body's is turned by the pose before it is integrated; read as fixed,
        # not.
        rotation = np.where(np.isnan(samples.rotation), np.eye(3), samples.rotation)
        linear, angular = np.nan_to_num(samples.linear), np.nan_to_num(samples.angular)
        return cls(
            samples,
            np.nan_to_num(samples.position),
            np.nan_to_num(samples.turned_about(up)),
            _integral(np.einsum("nij,nj->ni", rotation, linear), seconds),
            _integral(linear, seconds),
            _integral(np.einsum("nij,nj->ni", rotation, angular) @ up[:, None], seconds)[:, 0],
            _integral(angular @ up[:, None], seconds)[:, 0],
        )

    def windows(self, counts: Callable[[Window], bool]) -> Iterator[Window]:
        """Windows of a second that count; of slow motion, longer ones, up to ten."""
        seconds = (self.samples.stamps_ns - self.samples.stamps_ns[0]) / SECOND
        edges = np.searchsorted(seconds, np.arange(0.0, seconds[-1] + WINDOW_S, WINDOW_S))
        edges = np.unique(np.minimum(edges, seconds.size - 1))
        begin = 0
        for end in edges[1:].tolist():
            window = self.window(begin, end)
            if counts(window):
                yield window
            elif seconds[end] - seconds[begin] < _LONGEST_WINDOW_S:
                continue
            begin = end

    def window(self, begin: int, end: int) -> Window:
        """What happens from one sample to another."""
        step, body, fixed, turn, turn_body, turn_fixed = (
            values[end] - values[begin]
            for values in (
                self.position,
                self.by_body,
                self.by_fixed,
                self.turned,
                self.turned_by_body,
                self.turned_by_fixed,
            )
        )
        part = slice(begin, end + 1)
        return Window(
            int(self.samples.stamps_ns[begin]),
            float(self.samples.stamps_ns[end] - self.samples.stamps_ns[begin]) / SECOND,
            (_length(step), _length(fixed), _length(step - body), _length(step - fixed)),
            (
                abs(float(turn)),
                abs(float(turn_body)),
                abs(float(turn - turn_body)),
                abs(float(turn - turn_fixed)),
            ),
            _length(step) > _CLEAR_M
            and constant(self.samples.linear[part])
            and constant(self.samples.angular[part]),
        )


def pieces_of(samples: MotionSamples, up: Floats) -> Iterator[Sums]:
    """The pieces of a series in which samples follow one another.

    Args:
        samples: The series.
        up: The vertical (3,) in the fixed frame: turns are counted about it.
    """
    for piece in samples.pieces:
        own = np.zeros(samples.stamps_ns.size, np.bool_)
        own[piece] = True
        yield Sums.of(samples.only(own), up)


def _length(way: Floats) -> float:
    return float(np.linalg.norm(way))


def _integral(rates: Floats, seconds: Floats) -> Floats:
    """The trapezoid sum of rates (N, D) from the first sample to each, (N, D)."""
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(seconds)[:, None]
    return np.concatenate([np.zeros((1, rates.shape[1])), np.cumsum(steps, axis=0)])


def constant(values: Floats) -> bool:
    """Whether nothing in a column ever changes; NaN throughout counts."""
    known = values[np.isfinite(values).reshape(values.shape[0], -1).all(axis=1)]
    return known.size == 0 or bool(np.all(np.ptp(known, axis=0) <= CONSTANT))
