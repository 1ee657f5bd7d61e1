"""What the numbers of models may be: wide enough for every network in use, and nothing beyond.

A number that is too small makes a layer without weights, whose model says the same of everything;
one that is too large asks for more memory than there is. ``true`` is no number.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field


def _no_truth(value: object) -> object:
    if isinstance(value, bool):
        raise ValueError(f"expected a number, found {str(value).lower()}")  # noqa: TRY004
    return value


NO_TRUTH = BeforeValidator(_no_truth)
"""For numbers that are not whole: they are not strict, since YAML reads 1e-3 as a text."""
Steps = Annotated[int, Field(strict=True, ge=1, le=10_000)]
"""In time: of a horizon, of a history."""
Side = Annotated[int, Field(strict=True, ge=1, le=8192)]
"""Of a picture, pixels."""
Shrink = Annotated[int, Field(strict=True, ge=1, le=64)]
"""Pixels of a side that become one."""
Width = Annotated[int, Field(strict=True, ge=1, le=1024)]
"""Channels of a convolution."""
Units = Annotated[int, Field(strict=True, ge=1, le=16_384)]
"""Of a dense layer."""
Heads = Annotated[int, Field(strict=True, ge=1, le=64)]
"""Of an attention."""
Kernel = Annotated[int, Field(strict=True, ge=1, le=120)]
"""Of a convolution along one axis."""
Points = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]
"""Of a cloud."""
Beams = Annotated[int, Field(strict=True, ge=1, le=65_536)]
"""Of a laser scan."""
Metres = Annotated[float, Field(ge=0.001, le=10_000), NO_TRUTH]
"""A distance that is divided by."""
Share = Annotated[float, Field(ge=0, lt=1), NO_TRUTH]
"""Of units that a dropout leaves out."""
Weight = Annotated[float, Field(ge=0, le=1_000_000), NO_TRUTH]
"""Of a term of a loss."""
