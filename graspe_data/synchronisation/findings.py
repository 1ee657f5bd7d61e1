"""What two sources of a recording say of the same thing, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Course = Literal["agrees", "mended", "noted", "refused"]
"""``agrees``: both say the same. ``mended``: they differ with a known explanation, and the rows are
right. ``noted``: worth a look; the rows are as the manifest says. ``refused``: no rows."""


@dataclass(frozen=True)
class Finding:
    """One agreement or disagreement.

    ``kind`` names it in the docs' table; ``where`` is the topic, edge or frame; ``text`` is a
    sentence with both numbers and what is done; ``numbers`` are these numbers by name.
    """

    kind: str
    course: Course
    where: str
    text: str
    numbers: Mapping[str, float] = field(default_factory=dict)
