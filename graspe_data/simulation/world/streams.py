"""Random generators of a simulation, one for each thing that is drawn."""

from __future__ import annotations

import zlib

import numpy as np


def stream(name: str, seed: int, part: str, *more: int) -> np.random.Generator:
    """The generator of one part of a scenario: what one draws changes no other.

    Scenarios of other names draw otherwise from the same seed, so that no two of them share a
    layout.

    Args:
        name: Of the scenario.
        seed: Of the recording.
        part: What is drawn.
        more: Numbers it further.
    """
    return np.random.default_rng([seed, zlib.crc32(f"{name}/{part}".encode()), *more])
