"""The stages of a recording in their order: what builds, rederives and lists them walks this."""

from __future__ import annotations

from typing import Final

from pipelines.stages.candidates import CANDIDATES
from pipelines.stages.extract import EXTRACT
from pipelines.stages.label import LABEL
from pipelines.stages.reliability import RELIABILITY
from pipelines.stages.stage import Stage
from pipelines.stages.trajectory import TRAJECTORY

STAGES: Final[tuple[Stage, ...]] = (EXTRACT, RELIABILITY, TRAJECTORY, LABEL, CANDIDATES)
"""Each stands on ``extract``, and on nothing else."""
