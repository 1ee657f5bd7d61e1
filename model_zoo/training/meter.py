"""Losses of the epoch under way, and what its time went into."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeVar

import torch
from torch import Tensor

from graspe_data.errors import ZooError

_Item = TypeVar("_Item")


class LossMeans:
    """Sums of named scalars, kept on their device so that adding does not wait for it."""

    def __init__(self, steps: int = 0, sums: Mapping[str, float] | None = None) -> None:
        """Go on from what :meth:`sums` gave after so many steps."""
        self.steps = steps
        self._sums: dict[str, Tensor | float] = dict(sums or {})

    def add(self, values: Mapping[str, Tensor]) -> None:
        """Add one step."""
        self.steps += 1
        for name, value in values.items():
            self._sums[name] = self._sums.get(name, 0.0) + value.detach().to(torch.float64)

    def sums(self) -> dict[str, float]:
        """The sums so far.

        Raises:
            ZooError: One is not finite: the training has diverged.
        """
        sums = {name: float(total) for name, total in self._sums.items()}
        for name, total in sums.items():
            if not abs(total) < float("inf"):
                raise ZooError(
                    f"training: {name} became {total} within this epoch's first {self.steps} "
                    "steps. Lower the recipe's learning_rate or set gradient_clip."
                )
        return sums

    def means(self) -> dict[str, float]:
        """The means over the steps so far.

        Raises:
            ZooError: As :meth:`sums`.
        """
        return {name: total / max(1, self.steps) for name, total in self.sums().items()}


class Stopwatch:
    """Rows a second, and the share of the time spent waiting for them.

    Attributes:
        rows: Counted by its owner.
    """

    def __init__(self) -> None:
        """Start."""
        self._since = time.perf_counter()
        self._stopped: float | None = None
        self._waited = 0.0
        self.rows = 0

    def waiting(self, items: Iterable[_Item]) -> Iterator[_Item]:
        """Pass items on, and count the time until each comes."""
        iterator = iter(items)
        while True:
            begin = time.perf_counter()
            try:
                item = next(iterator)
            except StopIteration:
                return
            finally:
                self._waited += time.perf_counter() - begin
            yield item

    def stop(self) -> None:
        """Count no more time."""
        self._stopped = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Until now, or until it was stopped; never zero."""
        now = time.perf_counter() if self._stopped is None else self._stopped
        return max(now - self._since, 1e-9)

    @property
    def rate(self) -> float:
        """Rows a second."""
        return self.rows / self.seconds

    @property
    def wait_share(self) -> float:
        """Share of the time spent waiting."""
        return self._waited / self.seconds
