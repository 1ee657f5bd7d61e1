"""Who is told how far long work has come; the command line shows it."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Is told what is done."""

    def start(self, what: str, total: int) -> None:
        """A phase of so many units begins."""

    def advance(self, message: str) -> None:
        """One unit is done."""


class Silent:
    """Tells nobody."""

    def start(self, what: str, total: int) -> None:
        """Ignore the phase."""

    def advance(self, message: str) -> None:
        """Ignore the unit."""
