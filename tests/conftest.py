"""The real recordings, where they are at hand."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of the real recordings."""
    folder = os.environ.get("GRASPE_RECORDINGS")
    if not folder:
        pytest.skip("GRASPE_RECORDINGS is not set: the real recordings are not at hand")
    return Path(folder)
